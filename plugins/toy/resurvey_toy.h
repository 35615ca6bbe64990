/* A toy host for the tests of plugins in C and C++: walls and a flat ground, seen by casting one ray per pixel. No map, no
 * library: include it in a program of your own, link that with the plugin, and call the plugin's functions as a host does.
 *
 *   rsv_toy world;
 *   rsv_toy_street(&world, 160, 120);
 *   rsv_toy_plugin plugin;
 *   rsv_toy_open(&plugin, &resurvey_plugin_v1__mine, "{\"void\":255}");
 *   rsv_view seen = rsv_toy_see(&world, &rsv_toy_pose, 1, 1);
 *   RSV_TOY_CHECK(plugin.table.score(plugin.instance, &seen.labels, &seen, &score, &plugin.error) == RSV_OK);
 *
 * It sees what `resurvey_plugin::toy` of the Rust SDK and `resurvey_plugin.toy` of the Python package see: it is slow and exact.
 * What `resurvey plugins check` looks at, bad memory above all, it does not. */
#ifndef RESURVEY_TOY_H
#define RESURVEY_TOY_H

#include "resurvey_plugin.h"
#include <math.h>
#include <stdio.h>

/* Ends the program with the line when something is not so. */
#define RSV_TOY_CHECK(is_so_)                                                                                          \
  do {                                                                                                                 \
    if (!(is_so_)) {                                                                                                   \
      fprintf(stderr, "%s:%d: expected %s\n", __FILE__, __LINE__, #is_so_);                                            \
      exit(1);                                                                                                         \
    }                                                                                                                  \
  } while (0)

enum { RSV_STONE, RSV_GLASS, RSV_METAL, RSV_BANNER, RSV_PEDESTRIAN, RSV_CHAIR, RSV_SKY, RSV_FOLIAGE, RSV_OTHERS, RSV_TOY_CLASSES };
#define RSV_TOY_WALLS 64
#define RSV_TOY_RESULTS 64
#define RSV_TOY_OFF_WALL_M 0.02 /* by which a descriptor stands off its wall, so that it is seen first */

/* An upright rectangle, two-sided: bottom-left, along, up. */
typedef struct rsv_toy_wall {
  double corner[3], along[3], up[3];
  uint64_t fid; /* 0: of the base map */
  uint8_t class_index;
} rsv_toy_wall;

/* The world, and the host on it. Change what you like; a copy of one refers to the one that it was copied from until
 * rsv_toy_host is called on it. */
typedef struct rsv_toy {
  rsv_camera camera;
  rsv_toy_wall walls[RSV_TOY_WALLS];
  size_t wall_count;
  double ground_m;       /* height of the ground, class others */
  const uint8_t *photo;  /* labels of the camera's size that views are compared with; null: none */
  uint32_t is_cancelled; /* what cancelled() says */
  rsv_class classes[RSV_TOY_CLASSES];
  rsv_services services;
} rsv_toy;

/* A plugin that is tried, with a place for what it says when it has no answer: error.data, error.length. */
typedef struct rsv_toy_plugin {
  rsv_table table;
  rsv_instance *instance;
  rsv_error error;
  char text[512];
} rsv_toy_plugin;

/* What a call told the host, up to RSV_TOY_RESULTS of each; rsv_toy_drop gives the copies of the masks back. */
typedef struct rsv_toy_told {
  rsv_results results; /* hand this to the call */
  rsv_region regions[RSV_TOY_RESULTS];
  rsv_proposal proposals[RSV_TOY_RESULTS];
  rsv_descriptor descriptors[RSV_TOY_RESULTS]; /* that of proposal i is descriptors[i] */
  size_t region_count, proposal_count, heat_count;
} rsv_toy_told;

/* Where photos of rsv_toy_street are taken: eye height, looking north at a wall 10 m ahead. */
static const rsv_pose rsv_toy_pose = {{835000.0, 817000.0, 5.6}, 0.0, 0.0, 0.0};

/* ---- geometry ---------------------------------------------------------------------------------------------------------- */

static inline double rsv_toy_dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void rsv_toy_cross(const double *a, const double *b, double *c) {
  c[0] = a[1] * b[2] - a[2] * b[1], c[1] = a[2] * b[0] - a[0] * b[2], c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Right, down and forward of a camera. */
static inline void rsv_toy_axes(const rsv_pose *pose, double axes[3][3]) {
  double sin_y = sin(pose->yaw_rad), cos_y = cos(pose->yaw_rad), sin_p = sin(pose->pitch_rad), cos_p = cos(pose->pitch_rad);
  double sin_r = sin(pose->roll_rad), cos_r = cos(pose->roll_rad);
  const double right[3] = {cos_y, -sin_y, 0};
  double down[3];
  axes[2][0] = sin_y * cos_p, axes[2][1] = cos_y * cos_p, axes[2][2] = sin_p;
  rsv_toy_cross(axes[2], right, down);
  for (int i = 0; i < 3; i++) {
    axes[0][i] = cos_r * right[i] + sin_r * down[i];
    axes[1][i] = cos_r * down[i] - sin_r * right[i];
  }
}

/* The ray through pixel coordinates, one unit deep along the optical axis. */
static inline void rsv_toy_ray(const rsv_camera *camera, const double axes[3][3], double u, double v, double *ray) {
  double x = (u - camera->cx) / camera->fx, y = (v - camera->cy) / camera->fy;
  for (int i = 0; i < 3; i++) ray[i] = axes[2][i] + x * axes[0][i] + y * axes[1][i];
}

/* How many times the ray the first surface is away, infinite where there is none; the wall, null for the ground. */
static inline double rsv_toy_meet(const rsv_toy *toy, const rsv_point *origin, const double *ray, int with_descriptors,
                                  const rsv_toy_wall **met) {
  double nearest = (toy->ground_m - origin->height_m) / ray[2];
  if (!(nearest > 1e-9)) nearest = INFINITY;
  *met = NULL;
  for (size_t i = 0; i < toy->wall_count; i++) {
    const rsv_toy_wall *wall = &toy->walls[i];
    if (wall->fid && !with_descriptors) continue;
    const double to[3] = {wall->corner[0] - origin->easting_m, wall->corner[1] - origin->northing_m, wall->corner[2] - origin->height_m};
    double normal[3], inside[3];
    rsv_toy_cross(wall->along, wall->up, normal);
    double times = rsv_toy_dot(normal, to) / rsv_toy_dot(normal, ray);
    if (!(times > 1e-9) || !(times < nearest)) continue;
    for (int k = 0; k < 3; k++) inside[k] = times * ray[k] - to[k];
    double s = rsv_toy_dot(inside, wall->along) / rsv_toy_dot(wall->along, wall->along);
    double t = rsv_toy_dot(inside, wall->up) / rsv_toy_dot(wall->up, wall->up);
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) nearest = times, *met = wall;
  }
  return nearest;
}

static inline uint8_t rsv_toy_class(double times, const rsv_toy_wall *wall) {
  return isfinite(times) ? (wall ? wall->class_index : (uint8_t)RSV_OTHERS) : (uint8_t)RSV_SKY;
}

/* ---- the world --------------------------------------------------------------------------------------------------------- */

/* Adds a wall over a plan segment, seen from outside left to right. */
static inline rsv_toy_wall *rsv_toy_add_wall(rsv_toy *toy, double east, double north, double to_east, double to_north, double low_m,
                                             double high_m, uint8_t class_index) {
  RSV_TOY_CHECK(toy->wall_count < RSV_TOY_WALLS);
  rsv_toy_wall *wall = &toy->walls[toy->wall_count++];
  memset(wall, 0, sizeof *wall);
  wall->corner[0] = east, wall->corner[1] = north, wall->corner[2] = low_m;
  wall->along[0] = to_east - east, wall->along[1] = to_north - north, wall->up[2] = high_m - low_m;
  wall->class_index = class_index;
  return wall;
}

/* Puts a material descriptor on a wall, likewise; gives its feature id. */
static inline uint64_t rsv_toy_add_descriptor(rsv_toy *toy, double east, double north, double to_east, double to_north, double low_m,
                                              double high_m, uint8_t class_index) {
  rsv_toy_wall *wall = rsv_toy_add_wall(toy, east, north, to_east, to_north, low_m, high_m, class_index);
  double length = hypot(wall->along[0], wall->along[1]);
  wall->corner[0] += RSV_TOY_OFF_WALL_M * wall->along[1] / length;
  wall->corner[1] -= RSV_TOY_OFF_WALL_M * wall->along[0] / length;
  return wall->fid = (uint64_t)toy->wall_count;
}

/* What is seen from a pose, every `stride`-th pixel; rsv_toy_forget gives the memory back. */
static inline rsv_view rsv_toy_see(const rsv_toy *toy, const rsv_pose *pose, uint32_t stride, int with_descriptors) {
  rsv_view seen;
  memset(&seen, 0, sizeof seen);
  uint32_t width = (toy->camera.width + stride - 1) / stride, height = (toy->camera.height + stride - 1) / stride;
  size_t pixels = (size_t)width * height;
  uint8_t *labels = (uint8_t *)malloc(pixels);
  float *range_m = (float *)malloc(pixels * sizeof(float)), *points = (float *)malloc(pixels * 3 * sizeof(float));
  uint32_t *features = (uint32_t *)calloc(pixels, sizeof(uint32_t));
  rsv_view_feature *table = (rsv_view_feature *)calloc(RSV_TOY_WALLS, sizeof *table);
  RSV_TOY_CHECK(labels && range_m && points && features && table);
  double axes[3][3], ray[3];
  rsv_toy_axes(pose, axes);
  for (size_t i = 0; i < pixels; i++) {
    const rsv_toy_wall *wall;
    rsv_toy_ray(&toy->camera, (const double(*)[3])axes, (double)(i % width) * stride + 0.5, (double)(i / width) * stride + 0.5, ray);
    double times = rsv_toy_meet(toy, &pose->position, ray, with_descriptors, &wall);
    labels[i] = rsv_toy_class(times, wall);
    range_m[i] = (float)(times * sqrt(rsv_toy_dot(ray, ray)));
    for (int k = 0; k < 3; k++) points[3 * i + k] = isfinite(times) ? (float)(times * ray[k]) : NAN;
    if (!isfinite(times) || !wall || !wall->fid) continue;
    size_t index = 0;
    while (index < seen.feature_count && table[index].fid != wall->fid) index++;
    table[index].fid = wall->fid, table[index].class_index = wall->class_index;
    if (index == seen.feature_count) seen.feature_count++;
    features[i] = (uint32_t)index + 1;
  }
  const rsv_image images[4] = {{labels, width, height, width}, {range_m, width, height, width * sizeof(float)},
                               {points, width, height, width * 3 * sizeof(float)}, {features, width, height, width * sizeof(uint32_t)}};
  seen.size = sizeof seen, seen.origin = pose->position, seen.feature_table = table;
  seen.labels = images[0], seen.range_m = images[1], seen.points = images[2], seen.features = images[3];
  return seen;
}

static inline void rsv_toy_forget(rsv_view *seen) {
  free((void *)seen->labels.data);
  free((void *)seen->range_m.data);
  free((void *)seen->points.data);
  free((void *)seen->features.data);
  free((void *)seen->feature_table);
}

/* ---- services ---------------------------------------------------------------------------------------------------------- */

static inline rsv_status rsv_toy_render(void *context, const rsv_render_request *request, const rsv_pose *poses, size_t count,
                                        void *receiver, rsv_view_receiver receive, rsv_error *error) {
  (void)error;
  for (size_t i = 0; i < count; i++) {
    rsv_view seen = rsv_toy_see((const rsv_toy *)context, &poses[i], request->stride, (int)request->with_descriptors);
    receive(receiver, i, &seen);
    rsv_toy_forget(&seen);
  }
  return RSV_OK;
}

static inline int rsv_toy_has(const uint64_t set[4], uint8_t class_index) { return set[class_index / 64] >> class_index % 64 & 1; }

/* Adds what one pixel says to the counts of its view. */
static inline void rsv_toy_count(uint8_t in_photo, uint8_t in_view, const uint64_t ignored_in_photo[4],
                                 const uint64_t ignored_in_view[4], rsv_class_counts *counts) {
  if (in_photo >= RSV_TOY_CLASSES || rsv_toy_has(ignored_in_photo, in_photo) || rsv_toy_has(ignored_in_view, in_view)) return;
  counts[in_photo].photo++, counts[in_view].view++;
  counts[in_view].both += in_photo == in_view;
}

static inline rsv_status rsv_toy_compare_views(void *context, const rsv_compare_request *request, const rsv_pose *poses, size_t count,
                                               rsv_class_counts *counts, rsv_error *error) {
  const rsv_toy *toy = (const rsv_toy *)context;
  if (!toy->photo) return rsv_fail(error, "the toy host has no photo to compare with: set photo");
  if (request->boundary_tolerance_px > 0) return rsv_fail(error, "the toy host does not count boundaries");
  memset(counts, 0, count * RSV_TOY_CLASSES * sizeof *counts);
  for (size_t i = 0; i < count; i++) {
    double axes[3][3], ray[3];
    rsv_toy_axes(&poses[i], axes);
    for (uint32_t v = 0; v < toy->camera.height; v += request->stride)
      for (uint32_t u = 0; u < toy->camera.width; u += request->stride) {
        const rsv_toy_wall *wall;
        rsv_toy_ray(&toy->camera, (const double(*)[3])axes, u + 0.5, v + 0.5, ray);
        double times = rsv_toy_meet(toy, &poses[i].position, ray, 1, &wall);
        rsv_toy_count(toy->photo[(size_t)v * toy->camera.width + u], rsv_toy_class(times, wall), request->ignored_in_photo,
                      request->ignored_in_view, counts + i * RSV_TOY_CLASSES);
      }
  }
  return RSV_OK;
}

/* Compares a view at every heading: it counts pixels where the host counts cells of a panorama, and shares are alike. */
static inline rsv_status rsv_toy_compare_panoramas(void *context, const rsv_panorama_request *request, const rsv_point *positions,
                                                   size_t count, rsv_class_counts *counts, rsv_error *error) {
  double step_rad = 6.283185307179586 / request->columns, first = round(request->first_yaw_rad / step_rad);
  rsv_compare_request views;
  memset(&views, 0, sizeof views);
  views.size = sizeof views, views.stride = 1;
  memcpy(views.ignored_in_photo, request->ignored_in_photo, sizeof views.ignored_in_photo);
  memcpy(views.ignored_in_view, request->ignored_in_view, sizeof views.ignored_in_view);
  for (size_t i = 0; i < count; i++)
    for (uint32_t heading = 0; heading < request->yaw_count; heading++) {
      double yaw_rad = (first + (double)heading * request->yaw_step_columns) * step_rad;
      const rsv_pose pose = {positions[i], yaw_rad, request->pitch_rad, request->roll_rad};
      rsv_class_counts *to = counts + (i * request->yaw_count + heading) * RSV_TOY_CLASSES;
      rsv_status status = rsv_toy_compare_views(context, &views, &pose, 1, to, error);
      if (status != RSV_OK) return status;
    }
  return RSV_OK;
}

static inline rsv_status rsv_toy_inside_solid(void *context, const rsv_point *positions, size_t count, uint8_t *inside,
                                              rsv_error *error) {
  (void)context, (void)positions, (void)error;
  memset(inside, 0, count);
  return RSV_OK;
}

static inline rsv_status rsv_toy_pixel_rays(void *context, const rsv_pose *pose, const double (*pixels)[2], size_t count,
                                            double (*directions)[3], rsv_error *error) {
  (void)error;
  double axes[3][3];
  rsv_toy_axes(pose, axes);
  for (size_t i = 0; i < count; i++) {
    rsv_toy_ray(&((const rsv_toy *)context)->camera, (const double(*)[3])axes, pixels[i][0], pixels[i][1], directions[i]);
    double length = sqrt(rsv_toy_dot(directions[i], directions[i]));
    for (int k = 0; k < 3; k++) directions[i][k] /= length;
  }
  return RSV_OK;
}

static inline rsv_status rsv_toy_project(void *context, const rsv_pose *pose, const rsv_point *points, size_t count,
                                         double (*pixels)[2], rsv_error *error) {
  (void)error;
  const rsv_camera *camera = &((const rsv_toy *)context)->camera;
  const rsv_point *at = &pose->position;
  double axes[3][3];
  rsv_toy_axes(pose, axes);
  for (size_t i = 0; i < count; i++) {
    const double to[3] = {points[i].easting_m - at->easting_m, points[i].northing_m - at->northing_m, points[i].height_m - at->height_m};
    double depth_m = rsv_toy_dot(axes[2], to);
    pixels[i][0] = depth_m > 1e-9 ? camera->fx * rsv_toy_dot(axes[0], to) / depth_m + camera->cx : NAN;
    pixels[i][1] = depth_m > 1e-9 ? camera->fy * rsv_toy_dot(axes[1], to) / depth_m + camera->cy : NAN;
  }
  return RSV_OK;
}

static inline rsv_status rsv_toy_cast_rays(void *context, const rsv_point *origin, const double (*directions)[3], size_t count,
                                           double limit_m, uint32_t with_descriptors, rsv_ray_hit *hits, rsv_error *error) {
  (void)error;
  memset(hits, 0, count * sizeof *hits);
  for (size_t i = 0; i < count; i++) {
    const rsv_toy_wall *wall;
    double normal[3] = {0, 0, 1}, times = rsv_toy_meet((const rsv_toy *)context, origin, directions[i], (int)with_descriptors, &wall);
    double range_m = times * sqrt(rsv_toy_dot(directions[i], directions[i]));
    if (!isfinite(times) || range_m > limit_m) continue;
    if (wall) rsv_toy_cross(wall->along, wall->up, normal);
    double scale = (rsv_toy_dot(normal, directions[i]) > 0 ? -1 : 1) / sqrt(rsv_toy_dot(normal, normal));
    for (int k = 0; k < 3; k++) hits[i].normal[k] = scale * normal[k];
    hits[i].point.easting_m = origin->easting_m + times * directions[i][0];
    hits[i].point.northing_m = origin->northing_m + times * directions[i][1];
    hits[i].point.height_m = origin->height_m + times * directions[i][2];
    hits[i].range_m = range_m, hits[i].hit = 1, hits[i].class_index = rsv_toy_class(times, wall);
    hits[i].fid = wall ? wall->fid : 0, hits[i].has_fid = hits[i].fid != 0;
  }
  return RSV_OK;
}

static inline rsv_status rsv_toy_ground_height(void *context, const rsv_point *point, double *height_m, rsv_error *error) {
  const double down[1][3] = {{0, 0, -1}};
  rsv_ray_hit hit;
  rsv_status status = rsv_toy_cast_rays(context, point, down, 1, INFINITY, 0, &hit, error);
  *height_m = hit.hit ? hit.point.height_m : NAN;
  return status;
}

static inline rsv_status rsv_toy_parallel_for(void *context, size_t count, void *task, rsv_task run, rsv_error *error) {
  (void)context, (void)error;
  for (size_t i = 0; i < count; i++) run(task, i);
  return RSV_OK;
}

static inline void rsv_toy_log(void *context, uint32_t level, rsv_text text) {
  (void)context;
  fprintf(stderr, "level %u: %.*s\n", (unsigned)level, (int)text.length, text.data);
}

static inline void rsv_toy_progress(void *context, double fraction) { (void)context, (void)fraction; }

static inline uint32_t rsv_toy_cancelled(void *context) { return ((const rsv_toy *)context)->is_cancelled; }

/* Connects the services with this world. Descriptors near a point and WGS84 are not there: their functions are null. */
static inline void rsv_toy_host(rsv_toy *toy) {
  rsv_services *services = &toy->services;
  memset(services, 0, sizeof *services);
  services->size = sizeof *services, services->class_slots = RSV_TOY_CLASSES, services->context = toy;
  services->classes = toy->classes, services->class_count = RSV_TOY_CLASSES;
  services->render = rsv_toy_render, services->compare_views = rsv_toy_compare_views;
  services->compare_panoramas = rsv_toy_compare_panoramas, services->inside_solid = rsv_toy_inside_solid;
  services->pixel_rays = rsv_toy_pixel_rays, services->project = rsv_toy_project, services->cast_rays = rsv_toy_cast_rays;
  services->ground_height = rsv_toy_ground_height, services->parallel_for = rsv_toy_parallel_for;
  services->log = rsv_toy_log, services->progress = rsv_toy_progress, services->cancelled = rsv_toy_cancelled;
}

/* A street seen from rsv_toy_pose, without descriptors: 10 m ahead a stone wall with windows and a shop front, at its ends other
 * houses. The camera has 90 degrees over its diagonal. */
static inline void rsv_toy_street(rsv_toy *toy, uint32_t width, uint32_t height) {
  static const char *const names[] = {"stone", "glass", "metal", "banner", "pedestrian", "chair", "sky", "foliage", "others"};
  static const uint8_t colours[][3] = {{0, 0, 255}, {0, 255, 0}, {255, 165, 0}, {165, 42, 42}, {255, 0, 0}, {255, 192, 203},
                                       {0, 0, 0}, {255, 255, 0}, {173, 216, 230}};
  double east = rsv_toy_pose.position.easting_m, north = rsv_toy_pose.position.northing_m + 10;
  memset(toy, 0, sizeof *toy);
  toy->camera.size = sizeof toy->camera, toy->camera.width = width, toy->camera.height = height;
  toy->camera.fx = toy->camera.fy = hypot(width, height) / 2;
  toy->camera.cx = width / 2.0, toy->camera.cy = height / 2.0;
  toy->ground_m = 4;
  for (int i = 0; i < RSV_TOY_CLASSES; i++) {
    rsv_class *one = &toy->classes[i];
    one->name.data = names[i], one->name.length = strlen(names[i]), one->index = (uint8_t)i;
    one->kind = i < RSV_PEDESTRIAN ? RSV_CLASS_MATERIAL : i < RSV_SKY ? RSV_CLASS_DYNAMIC : RSV_CLASS_IGNORED;
    memcpy(one->colour, colours[i], 3);
    if (one->kind == RSV_CLASS_DYNAMIC) one->size_m[0] = one->size_m[1] = 0.5, one->size_m[2] = i == RSV_CHAIR ? 0.9 : 1.7;
  }
  rsv_toy_add_wall(toy, east - 9, north, east + 9, north, 4, 11, RSV_STONE);
  rsv_toy_add_wall(toy, east - 7, north - 0.05, east - 5, north - 0.05, 8.6, 10.1, RSV_GLASS);
  rsv_toy_add_wall(toy, east - 2.5, north - 0.05, east - 1, north - 0.05, 8.6, 10.1, RSV_GLASS);
  rsv_toy_add_wall(toy, east + 4, north - 0.05, east + 7, north - 0.05, 8.6, 10.1, RSV_GLASS);
  rsv_toy_add_wall(toy, east + 1, north - 0.05, east + 7, north - 0.05, 4, 7, RSV_METAL);
  rsv_toy_add_wall(toy, east - 16, north + 6, east - 9, north + 6, 4, 13, RSV_METAL);
  rsv_toy_add_wall(toy, east + 9, north - 3, east + 15, north - 3, 4, 10, RSV_GLASS);
  rsv_toy_host(toy);
}

/* ---- the plugin -------------------------------------------------------------------------------------------------------- */

/* Opens a plugin that is linked in, with all its settings: JSON sorted by name, without spaces, as the host writes it. */
static inline void rsv_toy_open(rsv_toy_plugin *plugin, const rsv_declaration *declaration, const char *settings) {
  rsv_host_info host;
  memset(&host, 0, sizeof host);
  host.size = sizeof host, host.abi_major = RSV_ABI_MAJOR, host.abi_minor = RSV_ABI_MINOR;
  memset(plugin, 0, sizeof *plugin);
  plugin->table.size = sizeof plugin->table;
  plugin->error.size = sizeof plugin->error, plugin->error.capacity = sizeof plugin->text - 1, plugin->error.data = plugin->text;
  const rsv_text text = {settings, strlen(settings)};
  RSV_TOY_CHECK(declaration->entry(&host, &plugin->table, &plugin->error) == RSV_OK);
  RSV_TOY_CHECK(plugin->table.create(text, &plugin->instance, &plugin->error) == RSV_OK);
}

static inline void rsv_toy_close(rsv_toy_plugin *plugin) { plugin->table.destroy(plugin->instance); }

static inline rsv_status rsv_toy_take_heat(void *context, const double (*cells)[3], size_t count) {
  (void)cells;
  ((rsv_toy_told *)context)->heat_count += count;
  return RSV_OK;
}

static inline rsv_status rsv_toy_take_region(void *context, const rsv_region *region) {
  rsv_toy_told *told = (rsv_toy_told *)context;
  if (told->region_count == RSV_TOY_RESULTS) return RSV_FAILED;
  rsv_region *own = &told->regions[told->region_count++];
  *own = *region;
  uint8_t *mask = (uint8_t *)malloc(region->mask_length);
  RSV_TOY_CHECK(mask);
  own->mask = (const uint8_t *)memcpy(mask, region->mask, region->mask_length);
  return RSV_OK;
}

static inline rsv_status rsv_toy_take_proposal(void *context, const rsv_proposal *proposal) {
  rsv_toy_told *told = (rsv_toy_told *)context;
  if (told->proposal_count == RSV_TOY_RESULTS) return RSV_FAILED;
  rsv_proposal *own = &told->proposals[told->proposal_count];
  *own = *proposal;
  if (proposal->descriptor) told->descriptors[told->proposal_count] = *proposal->descriptor;
  own->descriptor = proposal->descriptor ? &told->descriptors[told->proposal_count] : NULL;
  told->proposal_count++;
  return RSV_OK;
}

/* Begins to listen: hand &told->results to the call. */
static inline void rsv_toy_listen(rsv_toy_told *told) {
  memset(told, 0, sizeof *told);
  told->results.size = sizeof told->results, told->results.context = told;
  told->results.heat = rsv_toy_take_heat;
  told->results.region = rsv_toy_take_region;
  told->results.proposal = rsv_toy_take_proposal;
}

static inline void rsv_toy_drop(rsv_toy_told *told) {
  for (size_t i = 0; i < told->region_count; i++) free((void *)told->regions[i].mask);
  told->region_count = told->proposal_count = 0;
}

#endif
