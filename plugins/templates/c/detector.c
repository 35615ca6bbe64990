/* A change detector: in which regions do photo and view differ?
 *
 * Build: cc -std=c11 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden plugin.c -o libmy_plugin.so
 * Check: resurvey plugins check libmy_plugin.so
 *
 * resurvey_plugin.h is the whole contract, with its rules in front. */
#include "resurvey_plugin.h"
#include <stdlib.h>

/* The host checks settings against this schema, fills in what the user did not say, and hands over all of them. */
static const char schema[] = "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
                             "\"least_px\": {\"type\": \"integer\", \"default\": 100, \"minimum\": 1,"
                             " \"maximum\": 1000000, \"description\": \"smallest region, pixels\"}}}";

struct rsv_instance {
  uint32_t least_px;
};

static rsv_status create(rsv_text settings, rsv_instance **instance, rsv_error *error) {
  rsv_instance *made = malloc(sizeof *made);
  if (!made) return rsv_fail(error, "out of memory");
  made->least_px = (uint32_t)rsv_setting_number(settings, "least_px");
  *instance = made;
  return RSV_OK;
}

static void destroy(rsv_instance *instance) { free(instance); }

static uint8_t class_at(const rsv_image *image, uint32_t u, uint32_t v) {
  return ((const uint8_t *)rsv_row(image, v))[u];
}

static int differs(const rsv_comparison *comparison, uint32_t u, uint32_t v) {
  uint8_t after = class_at(&comparison->photo, u, v);
  return after != RSV_VOID && after != class_at(&comparison->view->labels, u, v);
}

/* The pixels of one region, and those that are still to be looked at. */
typedef struct found {
  uint32_t *pixels; /* v * width + u */
  size_t count;
  uint8_t *seen; /* one for each pixel of the photo: 1 once it belongs to a region */
} found;

static void look_at(const rsv_comparison *comparison, uint32_t u, uint32_t v, uint8_t before, uint8_t after,
                    found *region) {
  uint32_t index = v * comparison->photo.width + u;
  if (region->seen[index] || !differs(comparison, u, v) || class_at(&comparison->photo, u, v) != after ||
      class_at(&comparison->view->labels, u, v) != before)
    return;
  region->seen[index] = 1;
  region->pixels[region->count++] = index;
}

/* Collects the region that hangs together with (u, v), and tells the host when it is large enough. */
static rsv_status region_from(const rsv_comparison *comparison, uint32_t u, uint32_t v, uint32_t least_px,
                              found *region, const rsv_results *results, rsv_error *error) {
  uint32_t width = comparison->photo.width, height = comparison->photo.height;
  rsv_region told = {.size = sizeof told,
                     .class_before = class_at(&comparison->view->labels, u, v),
                     .class_after = class_at(&comparison->photo, u, v),
                     .left = u,
                     .top = v,
                     .right = u + 1,
                     .bottom = v + 1};
  region->count = 0;
  look_at(comparison, u, v, told.class_before, told.class_after, region);
  for (size_t next = 0; next < region->count; next++) {
    uint32_t x = region->pixels[next] % width, y = region->pixels[next] / width;
    if (x < told.left) told.left = x;
    if (x + 1 > told.right) told.right = x + 1;
    if (y + 1 > told.bottom) told.bottom = y + 1;
    if (x > 0) look_at(comparison, x - 1, y, told.class_before, told.class_after, region);
    if (y > 0) look_at(comparison, x, y - 1, told.class_before, told.class_after, region);
    if (x + 1 < width) look_at(comparison, x + 1, y, told.class_before, told.class_after, region);
    if (y + 1 < height) look_at(comparison, x, y + 1, told.class_before, told.class_after, region);
  }
  if (region->count < least_px) return RSV_OK;
  uint32_t columns = told.right - told.left;
  told.pixels = (uint32_t)region->count;
  told.mask_length = (size_t)columns * (told.bottom - told.top);
  uint8_t *mask = calloc(told.mask_length, 1);
  if (!mask) return rsv_fail(error, "out of memory");
  for (size_t i = 0; i < region->count; i++) {
    uint32_t x = region->pixels[i] % width, y = region->pixels[i] / width;
    mask[(size_t)(y - told.top) * columns + (x - told.left)] = 1;
  }
  told.mask = mask;
  /* The host copies at once. */
  rsv_status status = results->region(results->context, &told);
  free(mask);
  return status == RSV_OK ? RSV_OK : rsv_fail(error, "the host did not take a region");
}

static rsv_status detect(rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                         const rsv_results *results, rsv_error *error) {
  uint32_t width = comparison->photo.width, height = comparison->photo.height;
  size_t pixels = (size_t)width * height;
  found region = {malloc(pixels * sizeof(uint32_t)), 0, calloc(pixels, 1)};
  rsv_status status = RSV_OK;
  if (!region.pixels || !region.seen) status = rsv_fail(error, "out of memory");
  for (uint32_t v = 0; v < height && status == RSV_OK; v++) {
    /* Return within 200 ms of a cancel. */
    if (rsv_cancelled(services)) status = RSV_CANCELLED;
    for (uint32_t u = 0; u < width && status == RSV_OK; u++)
      if (!region.seen[(size_t)v * width + u] && differs(comparison, u, v))
        status = region_from(comparison, u, v, instance->least_px, &region, results, error);
  }
  free(region.pixels);
  free(region.seen);
  return status;
}

/* The host calls this once, after it has opened the library. `size` of the table is the host's: leave it alone. */
static rsv_status entry(const rsv_host_info *host, rsv_table *table, rsv_error *error) {
  (void)host;
  (void)error;
  table->settings_schema.data = schema;
  table->settings_schema.length = sizeof schema - 1;
  table->create = create;
  table->destroy = destroy;
  table->detect = detect;
  return RSV_OK;
}

/* The one symbol of the library: kind, entry, name, version, and a sentence for `resurvey plugins list`. */
RSV_EXPORT const rsv_declaration resurvey_plugin_v1__my_plugin = {
    RSV_HEADER(RSV_KIND_DETECTOR), entry, "my-plugin", "0.1.0", "Connected regions in which photo and view differ"};
