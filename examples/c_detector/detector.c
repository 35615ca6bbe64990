/* A change detector in C: regions in which the photo shows a class that the map does not have anywhere near.
 *
 * Pose, map and labels are all a little off, so contours never fall on each other: a strip along every edge differs between
 * photo and view although nothing has changed. This detector asks for more. A pixel is certain when no pixel of the view within
 * `tolerance_px` has the class of the photo, and no pixel of the photo that near has the class of the view. A region begins at
 * a certain pixel and takes in all that differ in the same way and hang together with it, so that it reaches to its true
 * edge. Regions of less than `least_px` are dropped. What moves (pedestrians, chairs: the classes of kind "dynamic") is
 * reported as well; sky, foliage and the like are not.
 *
 * Build: cc -std=c11 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden -I schema/include examples/c_detector/detector.c -o libnear_by.so
 * Check: resurvey plugins check libnear_by.so
 *
 * The order to read in: the declaration at the end, entry, create, detect, and then upwards. */
#include "resurvey_plugin.h"
#include <stdlib.h>

/* How a pixel differs: somehow, or by more than the tolerance. */
#define DIFFERS 1
#define CERTAIN 2

/* ---- settings ---------------------------------------------------------------------------------------------------------- */

/* The host checks what the user sets against this schema, fills in the rest, and hands all of it to create. */
static const char schema[] =
    "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
    "\"least_px\": {\"type\": \"integer\", \"default\": 150, \"minimum\": 1, \"maximum\": 1000000,"
    " \"description\": \"Smallest region, pixels.\"},"
    "\"tolerance_px\": {\"type\": \"integer\", \"default\": 6, \"minimum\": 0, \"maximum\": 100,"
    " \"description\": \"Contours of photo and view may be this far apart, pixels.\"}}}";

/* The header only names the struct: what is in it is the plugin's own business. One is never used by two threads at once,
 * so nothing here needs a lock; but there may be several, so nothing here may be static. */
struct rsv_instance {
  uint32_t least_px, tolerance_px;
};

static rsv_status create(rsv_text settings, rsv_instance **instance, rsv_error *error) {
  rsv_instance *made = malloc(sizeof *made);
  if (!made) return rsv_fail(error, "out of memory");
  /* The header reads settings, so that a plugin with two numbers needs no JSON library. */
  made->least_px = (uint32_t)rsv_setting_number(settings, "least_px");
  made->tolerance_px = (uint32_t)rsv_setting_number(settings, "tolerance_px");
  *instance = made;
  return RSV_OK;
}

/* The library that made it frees it: the host frees nothing of ours, and we nothing of the host's. */
static void destroy(rsv_instance *instance) { free(instance); }

/* ---- images ------------------------------------------------------------------------------------------------------------ */

/* A row of an image of classes. Rows may be padded: never data + row * width. */
static const uint8_t *row_of(const rsv_image *image, uint32_t row) { return (const uint8_t *)rsv_row(image, row); }

/* What a call works on: allocated in detect and freed there, whatever happens in between. */
typedef struct work {
  uint32_t width, height;
  uint8_t *differs; /* one for each pixel, row by row: DIFFERS, CERTAIN, or 0 where they agree or a region has it */
  uint8_t *near_by; /* likewise: 1 where the class in question is near */
  uint8_t *rows;    /* what is near in the own row */
  uint32_t *pixels; /* of the region that is being collected: row * width + column */
} work;

static void give_back(work *work) {
  free(work->differs);
  free(work->near_by);
  free(work->rows);
  free(work->pixels);
}

/* near_by = 1 in a square of `reach` pixels around every pixel of `image` that has `class_index`. Along rows and then along
 * columns: the time does not grow with the reach. */
static void spread(const rsv_image *image, uint8_t class_index, uint32_t reach, work *work) {
  uint32_t width = work->width, height = work->height;
  for (uint32_t v = 0; v < height; v++) {
    const uint8_t *classes = row_of(image, v);
    uint32_t last = 0, seen = 0; /* the class was last seen at column last - 1 */
    for (uint32_t u = 0; u < width + reach; u++) {
      if (u < width && classes[u] == class_index) last = u + 1, seen = 1;
      if (u >= reach) work->rows[(size_t)v * width + u - reach] = seen && u + 1 <= last + 2 * reach;
    }
  }
  for (uint32_t u = 0; u < width; u++) {
    uint32_t last = 0, seen = 0;
    for (uint32_t v = 0; v < height + reach; v++) {
      if (v < height && work->rows[(size_t)v * width + u]) last = v + 1, seen = 1;
      if (v >= reach) work->near_by[(size_t)(v - reach) * width + u] = seen && v + 1 <= last + 2 * reach;
    }
  }
}

/* A difference is not certain at a pixel where `here` has the class and `there` has it near by. */
static void forgive(const rsv_image *here, const rsv_image *there, uint8_t class_index, uint32_t reach, work *work) {
  spread(there, class_index, reach, work);
  for (uint32_t v = 0; v < work->height; v++) {
    const uint8_t *classes = row_of(here, v);
    for (uint32_t u = 0; u < work->width; u++)
      if (classes[u] == class_index && work->near_by[(size_t)v * work->width + u] &&
          work->differs[(size_t)v * work->width + u])
        work->differs[(size_t)v * work->width + u] = DIFFERS;
  }
}

/* ---- regions ----------------------------------------------------------------------------------------------------------- */

/* Adds a pixel to the region when it differs in the same way as the region does, and gives the new number of pixels. */
static size_t take(const rsv_comparison *comparison, const rsv_region *region, uint32_t u, uint32_t v, work *work,
                   size_t count) {
  uint32_t index = v * work->width + u;
  if (!work->differs[index] || row_of(&comparison->photo, v)[u] != region->class_after ||
      row_of(&comparison->view->labels, v)[u] != region->class_before)
    return count;
  work->differs[index] = 0;
  work->pixels[count] = index;
  return count + 1;
}

/* Collects all that hangs together with (u, v) by its sides: the list of pixels is the queue of those to look around. */
static void collect(const rsv_comparison *comparison, uint32_t u, uint32_t v, work *work, rsv_region *region) {
  size_t count = take(comparison, region, u, v, work, 0);
  for (size_t next = 0; next < count; next++) {
    uint32_t x = work->pixels[next] % work->width, y = work->pixels[next] / work->width;
    if (x < region->left) region->left = x;
    if (y < region->top) region->top = y;
    if (x >= region->right) region->right = x + 1;
    if (y >= region->bottom) region->bottom = y + 1;
    if (x > 0) count = take(comparison, region, x - 1, y, work, count);
    if (y > 0) count = take(comparison, region, x, y - 1, work, count);
    if (x + 1 < work->width) count = take(comparison, region, x + 1, y, work, count);
    if (y + 1 < work->height) count = take(comparison, region, x, y + 1, work, count);
  }
  region->pixels = (uint32_t)count;
}

/* Tells the host of a region. It copies at once: the mask may go as soon as the call returns. */
static rsv_status tell(rsv_region *region, const work *work, const rsv_results *results, rsv_error *error) {
  uint32_t columns = region->right - region->left;
  region->mask_length = (size_t)columns * (region->bottom - region->top);
  uint8_t *mask = calloc(region->mask_length, 1);
  if (!mask) return rsv_fail(error, "out of memory");
  for (size_t i = 0; i < region->pixels; i++) {
    uint32_t x = work->pixels[i] % work->width, y = work->pixels[i] / work->width;
    mask[(size_t)(y - region->top) * columns + (x - region->left)] = 1;
  }
  region->mask = mask;
  rsv_status status = results->region(results->context, region);
  free(mask);
  return status == RSV_OK ? RSV_OK : rsv_fail(error, "the host did not take a region");
}

/* ---- the call ---------------------------------------------------------------------------------------------------------- */

/* Marks the pixels in which photo and view differ, and those that are certain. */
static rsv_status compare(const rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                          work *work) {
  uint8_t is_compared[256] = {0};
  for (size_t i = 0; i < services->class_count; i++)
    is_compared[services->classes[i].index] = services->classes[i].kind != RSV_CLASS_IGNORED;
  for (uint32_t v = 0; v < work->height; v++) {
    const uint8_t *in_photo = row_of(&comparison->photo, v), *in_view = row_of(&comparison->view->labels, v);
    for (uint32_t u = 0; u < work->width; u++)
      work->differs[(size_t)v * work->width + u] =
          in_photo[u] != RSV_VOID && in_photo[u] != in_view[u] && is_compared[in_photo[u]] ? CERTAIN : 0;
  }
  for (size_t i = 0; i < services->class_count; i++) {
    /* Between two classes is often enough to return within 200 ms of a cancel. */
    if (rsv_cancelled(services)) return RSV_CANCELLED;
    uint8_t class_index = services->classes[i].index;
    forgive(&comparison->photo, &comparison->view->labels, class_index, instance->tolerance_px, work);
    forgive(&comparison->view->labels, &comparison->photo, class_index, instance->tolerance_px, work);
  }
  return RSV_OK;
}

static rsv_status detect(rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                         const rsv_results *results, rsv_error *error) {
  work work = {.width = comparison->photo.width, .height = comparison->photo.height};
  size_t pixels = (size_t)work.width * work.height;
  work.differs = malloc(pixels);
  work.near_by = malloc(pixels);
  work.rows = malloc(pixels);
  work.pixels = malloc(pixels * sizeof *work.pixels);
  rsv_status status = work.differs && work.near_by && work.rows && work.pixels
                          ? compare(instance, services, comparison, &work)
                          : rsv_fail(error, "out of memory");
  for (uint32_t v = 0; v < work.height && status == RSV_OK; v++) {
    if (rsv_cancelled(services)) status = RSV_CANCELLED;
    for (uint32_t u = 0; u < work.width && status == RSV_OK; u++) {
      if (work.differs[(size_t)v * work.width + u] != CERTAIN) continue;
      /* `size` tells a newer host which fields we know of. */
      rsv_region region = {.size = sizeof region,
                           .class_before = row_of(&comparison->view->labels, v)[u],
                           .class_after = row_of(&comparison->photo, v)[u],
                           .left = u,
                           .top = v,
                           .right = u + 1,
                           .bottom = v + 1};
      collect(comparison, u, v, &work, &region);
      if (region.pixels >= instance->least_px) status = tell(&region, &work, results, error);
    }
  }
  give_back(&work);
  return status;
}

/* ---- the line ---------------------------------------------------------------------------------------------------------- */

/* Called once after the library is opened: puts the functions into the host's table. The table's `size` is the host's. */
static rsv_status entry(const rsv_host_info *host, rsv_table *table, rsv_error *error) {
  (void)host; /* every host of this major version will do */
  (void)error;
  table->settings_schema.data = schema;
  table->settings_schema.length = sizeof schema - 1; /* without the zero at its end */
  table->create = create;
  table->destroy = destroy;
  table->detect = detect;
  return RSV_OK;
}

/* The only symbol that the library exports. The host reads kind, name, version and the sentence from the file, before any of
 * the code above runs. */
RSV_EXPORT const rsv_declaration resurvey_plugin_v1__near_by = {
    RSV_HEADER(RSV_KIND_DETECTOR), entry, "near-by", "1.0.0",
    "Regions whose class is nowhere near in the other image"};
