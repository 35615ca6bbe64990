/* A descriptor estimator: what does each region mean for the map? This one measures rectangles on upright walls, and says
 * of everything else which requirement it missed, and by what.
 *
 * Build: cc -std=c11 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden plugin.c -o libmy_plugin.so -lm
 * Check: resurvey plugins check libmy_plugin.so
 *
 * resurvey_plugin.h is the whole contract, with its rules in front. */
#include "resurvey_plugin.h"
#include <math.h>
#include <stdlib.h>

/* The host checks settings against this schema, fills in what the user did not say, and hands over all of them. */
static const char schema[] =
    "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
    "\"plane_m\": {\"type\": \"number\", \"default\": 0.2, \"minimum\": 0, \"maximum\": 10,"
    " \"description\": \"largest distance of a point of the region from its plane, metres\"},"
    "\"range_m\": {\"type\": \"number\", \"default\": 50, \"minimum\": 1, \"maximum\": 1000,"
    " \"description\": \"largest distance from the camera, metres\"}}}";

struct rsv_instance {
  double plane_m, range_m;
};

typedef struct vec {
  double x, y, z; /* east, north, up */
} vec;

static vec sub(vec a, vec b) { return (vec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static vec add(vec a, vec b) { return (vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static vec times(vec a, double s) { return (vec){a.x * s, a.y * s, a.z * s}; }
static double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static vec cross(vec a, vec b) {
  return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static rsv_status create(rsv_text settings, rsv_instance **instance, rsv_error *error) {
  rsv_instance *made = malloc(sizeof *made);
  if (!made) return rsv_fail(error, "out of memory");
  made->plane_m = rsv_setting_number(settings, "plane_m");
  made->range_m = rsv_setting_number(settings, "range_m");
  *instance = made;
  return RSV_OK;
}

static void destroy(rsv_instance *instance) { free(instance); }

/* Offset of the surface in a pixel from the view's origin; NaN where there is none. */
static vec point_at(const rsv_view *view, uint32_t u, uint32_t v) {
  const float *point = (const float *)rsv_row(&view->points, v) + 3 * (size_t)u;
  return (vec){point[0], point[1], point[2]};
}

static int is_inside(const rsv_region *region, uint32_t u, uint32_t v) {
  if (u < region->left || u >= region->right || v < region->top || v >= region->bottom) return 0;
  return region->mask[(size_t)(v - region->top) * (region->right - region->left) + (u - region->left)];
}

/* Whether the view shows a descriptor of the region's class here. */
static int shows_descriptor(const rsv_comparison *comparison, const rsv_region *region, uint32_t u, uint32_t v) {
  const rsv_view *view = comparison->view;
  uint32_t feature = ((const uint32_t *)rsv_row(&view->features, v))[u];
  return feature && feature <= view->feature_count && view->feature_table[feature - 1].class_index == region->class_before;
}

/* The surface of the map behind a region. */
typedef struct surface {
  size_t points, descriptor; /* pixels with a surface, and those that show a descriptor of class_before */
  vec middle;                /* of the points */
  vec gone;                  /* of the points of the descriptor */
  vec normal;                /* unit, towards the camera; zero when there is none */
  double range_m;
} surface;

static surface surface_of(const rsv_comparison *comparison, const rsv_region *region) {
  surface found = {0};
  vec area = {0, 0, 0};
  for (uint32_t v = region->top; v < region->bottom; v++)
    for (uint32_t u = region->left; u < region->right; u++) {
      vec here = point_at(comparison->view, u, v);
      if (!is_inside(region, u, v) || !isfinite(here.x)) continue;
      found.points++;
      found.middle = add(found.middle, here);
      if (shows_descriptor(comparison, region, u, v)) {
        found.descriptor++;
        found.gone = add(found.gone, here);
      }
      if (!is_inside(region, u + 1, v) || !is_inside(region, u, v + 1)) continue;
      /* The area of each square of pixels as a vector: the sum points along the normal. */
      vec part = cross(sub(point_at(comparison->view, u, v + 1), here), sub(point_at(comparison->view, u + 1, v), here));
      if (isfinite(part.x)) area = add(area, part);
    }
  if (found.points) found.middle = times(found.middle, 1.0 / (double)found.points);
  if (found.descriptor) found.gone = times(found.gone, 1.0 / (double)found.descriptor);
  const rsv_point *camera = &comparison->estimate->pose.position, *origin = &comparison->view->origin;
  vec back = {camera->easting_m - origin->easting_m, camera->northing_m - origin->northing_m,
              camera->height_m - origin->height_m};
  back = sub(back, found.middle);
  found.range_m = sqrt(dot(back, back));
  double size = sqrt(dot(area, area));
  if (size > 0) found.normal = times(area, (dot(area, back) < 0 ? -1.0 : 1.0) / size);
  return found;
}

/* What a proposal that changes nothing says: the first requirement that is not met, with its number. */
static int missed(rsv_proposal *proposal, const char *requirement, int is_met, double measured, double limit,
                  const char *unit) {
  if (is_met) return 0;
  proposal->kind = RSV_REJECT;
  proposal->requirement = (rsv_text){requirement, strlen(requirement)};
  proposal->unit = (rsv_text){unit, strlen(unit)};
  proposal->measured = measured;
  proposal->limit = limit;
  return 1;
}

static uint32_t edge_px(const rsv_comparison *comparison, const rsv_region *region) {
  uint32_t right = comparison->photo.width - region->right, bottom = comparison->photo.height - region->bottom;
  uint32_t sides = region->left < right ? region->left : right, ends = region->top < bottom ? region->top : bottom;
  return sides < ends ? sides : ends;
}

/* The rectangle on the wall that has the moments of the points of the region; gives by how much, as a share, the region
 * covers more or less of the wall than it. */
static double measure(const rsv_comparison *comparison, const rsv_region *region, const surface *wall,
                      rsv_descriptor *rectangle) {
  const rsv_pose *pose = &comparison->estimate->pose;
  const rsv_point *origin = &comparison->view->origin;
  double length = hypot(wall->normal.x, wall->normal.y);
  vec normal = {wall->normal.x / length, wall->normal.y / length, 0};
  vec along = {-normal.y, normal.x, 0}; /* to the right as seen from outside */
  vec forward = {sin(pose->yaw_rad) * cos(pose->pitch_rad), cos(pose->yaw_rad) * cos(pose->pitch_rad), sin(pose->pitch_rad)};
  vec camera = {pose->position.easting_m - origin->easting_m, pose->position.northing_m - origin->northing_m,
                pose->position.height_m - origin->height_m};
  /* How much of the wall a pixel covers: depth cubed over focal lengths and distance of the wall. */
  double scale = comparison->camera->fx * comparison->camera->fy * fabs(dot(sub(wall->middle, camera), normal));
  double area = 0, sum[2] = {0, 0}, squares[2] = {0, 0};
  for (uint32_t v = region->top; v < region->bottom; v++)
    for (uint32_t u = region->left; u < region->right; u++) {
      vec here = point_at(comparison->view, u, v);
      if (!is_inside(region, u, v) || !isfinite(here.x)) continue;
      double part = pow(dot(sub(here, camera), forward), 3) / scale;
      /* From the middle: squares of small numbers keep their digits. */
      const double at[2] = {dot(sub(here, wall->middle), along), here.z - wall->middle.z};
      area += part;
      for (int i = 0; i < 2; i++) sum[i] += part * at[i], squares[i] += part * at[i] * at[i];
    }
  double centre[2], size[2];
  for (int i = 0; i < 2; i++) {
    centre[i] = sum[i] / area;
    /* A rectangle of width w has the variance w^2/12: exact to a fraction of a pixel, where the outermost are not. */
    size[i] = sqrt(12 * fmax(0, squares[i] / area - centre[i] * centre[i]));
  }
  const double corners[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (int i = 0; i < 4; i++) {
    double right = centre[0] + corners[i][0] * size[0];
    rectangle->corners[i][0] = origin->easting_m + wall->middle.x + right * along.x;
    rectangle->corners[i][1] = origin->northing_m + wall->middle.y + right * along.y;
    rectangle->corners[i][2] = origin->height_m + wall->middle.z + centre[1] + corners[i][1] * size[1];
  }
  rectangle->normal[0] = normal.x;
  rectangle->normal[1] = normal.y;
  double pixel = sqrt(area / (double)wall->points);
  const double *covariance = comparison->estimate->covariance;
  rectangle->sigma_position_m = sqrt(covariance[0] + covariance[4] + pixel * pixel);
  rectangle->sigma_size_m = pixel;
  rectangle->has = RSV_HAS_SIGMA | RSV_HAS_SIGMA_SIZE;
  return size[0] * size[1] > 0 ? fabs(area / (size[0] * size[1]) - 1) : 1;
}

static double furthest_m(const rsv_comparison *comparison, const rsv_region *region, const surface *wall) {
  double furthest = 0;
  for (uint32_t v = region->top; v < region->bottom; v++)
    for (uint32_t u = region->left; u < region->right; u++) {
      vec here = point_at(comparison->view, u, v);
      if (is_inside(region, u, v) && isfinite(here.x))
        furthest = fmax(furthest, fabs(dot(wall->normal, sub(here, wall->middle))));
    }
  return furthest;
}

static int is_material(const rsv_services *services, uint8_t class_index) {
  for (size_t i = 0; i < services->class_count; i++)
    if (services->classes[i].index == class_index) return services->classes[i].kind == RSV_CLASS_MATERIAL;
  return 0;
}

/* Fills in what region `index` means. */
static void meaning(const rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                    const rsv_region *region, rsv_proposal *proposal, rsv_descriptor *rectangle) {
  proposal->pixels = region->pixels;
  proposal->class_before = region->class_before;
  proposal->class_after = region->class_after;
  surface wall = surface_of(comparison, region);
  if (2 * wall.descriptor > region->pixels) {
    const rsv_point *origin = &comparison->view->origin;
    proposal->kind = RSV_REMOVE;
    proposal->class_index = region->class_before;
    proposal->near_point[0] = origin->easting_m + wall.gone.x;
    proposal->near_point[1] = origin->northing_m + wall.gone.y;
    proposal->near_point[2] = origin->height_m + wall.gone.z;
    proposal->sigma_m = 0.5;
    return;
  }
  double share = (double)wall.points / (region->pixels ? region->pixels : 1);
  double edge = edge_px(comparison, region), size = dot(wall.normal, wall.normal);
  double off_m = furthest_m(comparison, region, &wall);
  double lean_deg = asin(fmin(1, fabs(wall.normal.z))) * 57.29577951308232;
  if (missed(proposal, "material-class", is_material(services, region->class_after), 0, 1, "material") ||
      missed(proposal, "on-a-surface", share >= 0.9, share, 0.9, "ratio") ||
      missed(proposal, "two-dimensional", size > 0, size, 0, "m2") ||
      missed(proposal, "captured-entirely", edge >= 1, edge, 1, "px") ||
      missed(proposal, "within-range", wall.range_m <= instance->range_m, wall.range_m, instance->range_m, "m") ||
      missed(proposal, "coplanar", off_m <= instance->plane_m, off_m, instance->plane_m, "m") ||
      missed(proposal, "upright", lean_deg <= 10, lean_deg, 10, "deg"))
    return;
  double off = measure(comparison, region, &wall, rectangle);
  if (missed(proposal, "rectangle", off <= 0.15, off, 0.15, "ratio")) return;
  proposal->kind = RSV_PLACE;
  proposal->descriptor = rectangle;
  rectangle->class_index = region->class_after;
}

static rsv_status estimate(rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                           const rsv_region *regions, size_t region_count, size_t region_step,
                           const rsv_results *results, rsv_error *error) {
  for (size_t i = 0; i < region_count; i++) {
    /* Return within 200 ms of a cancel. */
    if (rsv_cancelled(services)) return RSV_CANCELLED;
    /* Not regions[i]: in a newer host a region may be longer. */
    const rsv_region *region = (const rsv_region *)((const char *)regions + i * region_step);
    rsv_descriptor rectangle = {.size = sizeof rectangle, .kind = RSV_MATERIAL};
    rsv_proposal proposal = {.size = sizeof proposal, .region = (uint32_t)i};
    meaning(instance, services, comparison, region, &proposal, &rectangle);
    if (results->proposal(results->context, &proposal) != RSV_OK)
      return rsv_fail(error, "the host did not take a proposal");
  }
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
  table->estimate = estimate;
  return RSV_OK;
}

/* The one symbol of the library: kind, entry, name, version, and a sentence for `resurvey plugins list`. */
RSV_EXPORT const rsv_declaration resurvey_plugin_v1__my_plugin = {
    RSV_HEADER(RSV_KIND_ESTIMATOR), entry, "my-plugin", "0.1.0", "Measures rectangles on upright walls"};
