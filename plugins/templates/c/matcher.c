/* A matcher: how well does one view of the map fit the photo? The host makes the candidate poses, renders and searches.
 *
 * Build: cc -std=c11 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden plugin.c -o libmy_plugin.so
 * Check: resurvey plugins check libmy_plugin.so
 *
 * resurvey_plugin.h is the whole contract, with its rules in front. */
#include "resurvey_plugin.h"
#include <stdlib.h>

/* The host checks settings against this schema, fills in what the user did not say, and hands over all of them. */
static const char schema[] = "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
                             "\"void\": {\"type\": \"integer\", \"default\": 255, \"minimum\": 0, \"maximum\": 255,"
                             " \"description\": \"class of the photo that is not compared\"}}}";

struct rsv_instance {
  uint8_t void_class;
};

static rsv_status create(rsv_text settings, rsv_instance **instance, rsv_error *error) {
  rsv_instance *made = malloc(sizeof *made);
  if (!made) return rsv_fail(error, "out of memory");
  made->void_class = (uint8_t)rsv_setting_number(settings, "void");
  *instance = made;
  return RSV_OK;
}

static void destroy(rsv_instance *instance) { free(instance); }

/* From 0 to 1, higher is better; photo and view have one size. */
static rsv_status score(rsv_instance *instance, const rsv_image *photo, const rsv_view *view, double *score,
                        rsv_error *error) {
  size_t same = 0, compared = 0;
  for (uint32_t v = 0; v < photo->height; v++) {
    /* Rows may be padded: never data + v * width. */
    const uint8_t *in_photo = (const uint8_t *)rsv_row(photo, v), *in_view = (const uint8_t *)rsv_row(&view->labels, v);
    for (uint32_t u = 0; u < photo->width; u++) {
      if (in_photo[u] == instance->void_class) continue;
      compared++;
      same += in_photo[u] == in_view[u];
    }
  }
  if (!compared) return rsv_fail(error, "expected labels in the photo, found only void");
  *score = (double)same / (double)compared;
  return RSV_OK;
}

/* The host calls this once, after it has opened the library. `size` of the table is the host's: leave it alone. */
static rsv_status entry(const rsv_host_info *host, rsv_table *table, rsv_error *error) {
  (void)host;
  (void)error;
  table->settings_schema.data = schema;
  table->settings_schema.length = sizeof schema - 1;
  table->create = create;
  table->destroy = destroy;
  table->score = score;
  return RSV_OK;
}

/* The one symbol of the library: kind, entry, name, version, and a sentence for `resurvey plugins list`. */
RSV_EXPORT const rsv_declaration resurvey_plugin_v1__my_plugin = {
    RSV_HEADER(RSV_KIND_MATCHER), entry, "my-plugin", "0.1.0",
    "Share of the pixels whose class is the same in photo and view"};
