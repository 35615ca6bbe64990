/* A segmenter: which class is each pixel of a photo? This one takes the class whose colour is nearest, which reads pictures in
 * class colours and no photographs: put a network in its place.
 *
 * Build: cc -std=c11 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden plugin.c -o libmy_plugin.so
 * Check: resurvey plugins check libmy_plugin.so
 *
 * resurvey_plugin.h is the whole contract, with its rules in front. */
#include "resurvey_plugin.h"
#include <stdlib.h>

/* The host checks settings against this schema, fills in what the user did not say, and hands over all of them. A string with
 * "format": "file" names a file that the plugin reads, such as the weights of a network: the host records its SHA-256, and
 * rsv_setting_text gives its path. */
static const char schema[] =
    "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
    "\"reach\": {\"type\": \"integer\", \"default\": 60, \"minimum\": 0, \"maximum\": 765,"
    " \"description\": \"largest difference of a colour from that of its class, sum over red, green and blue\"}}}";

struct rsv_instance {
  int reach;
};

static rsv_status create(rsv_text settings, rsv_instance **instance, rsv_error *error) {
  rsv_instance *made = malloc(sizeof *made);
  if (!made) return rsv_fail(error, "out of memory");
  made->reach = (int)rsv_setting_number(settings, "reach");
  *instance = made;
  return RSV_OK;
}

static void destroy(rsv_instance *instance) { free(instance); }

static int difference(const uint8_t *a, const uint8_t *b) {
  return abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2]);
}

/* The class whose colour is nearest, the lower index of equals; void when none is near. */
static uint8_t nearest(const rsv_services *services, const uint8_t *colour, int reach) {
  uint8_t label = RSV_VOID;
  int least = reach + 1;
  for (size_t i = 0; i < services->class_count; i++) {
    int off = difference(colour, services->classes[i].colour);
    if (off < least) {
      least = off;
      label = services->classes[i].index;
    }
  }
  return label;
}

/* Photo and labels have one size. Nobody knows yet where the photo was taken: of the services there are the class table,
 * parallel_for, log, progress and cancelled. */
static rsv_status segment(rsv_instance *instance, const rsv_services *services, const rsv_picture *picture,
                          const rsv_labels *labels, rsv_error *error) {
  (void)error;
  for (uint32_t v = 0; v < labels->height; v++) {
    /* Return within 200 ms of a cancel; a network looks before its forward pass. */
    if (rsv_cancelled(services)) return RSV_CANCELLED;
    /* Rows may be padded, those of the labels as well: step by row_bytes, not by the width. */
    const uint8_t *colours = (const uint8_t *)rsv_row(&picture->pixels, v);
    uint8_t *row = labels->data + v * labels->row_bytes;
    for (uint32_t u = 0; u < labels->width; u++) row[u] = nearest(services, colours + 3 * (size_t)u, instance->reach);
  }
  return RSV_OK;
}

/* The host calls this once, after it has opened the library. `size` of the table is the host's: leave it alone. */
static rsv_status entry(const rsv_host_info *host, rsv_table *table, rsv_error *error) {
  (void)host;
  /* The fourth kind came after the first hosts: their table ends before it. */
  if (!RSV_HAS(rsv_table, table, segment)) return rsv_fail(error, "expected a host that knows segmenters");
  table->settings_schema.data = schema;
  table->settings_schema.length = sizeof schema - 1;
  table->create = create;
  table->destroy = destroy;
  table->segment = segment;
  return RSV_OK;
}

/* The one symbol of the library: kind, entry, name, version, and a sentence for `resurvey plugins list`. */
RSV_EXPORT const rsv_declaration resurvey_plugin_v1__my_plugin = {
    RSV_HEADER(RSV_KIND_SEGMENTER), entry, "my-plugin", "0.1.0",
    "The class with the nearest colour, for pictures in class colours"};
