/* The estimator, on the toy street of resurvey_toy.h: make test */
#include "resurvey_toy.h"

extern const rsv_declaration resurvey_plugin_v1__my_plugin;

static rsv_toy_told told;

/* What the plugin makes of the only region in which the photo of one world differs from the view of another. */
static const rsv_proposal *estimate(const rsv_toy_plugin *plugin, const rsv_toy *map, const rsv_toy *real) {
  /* Obliquely: a wall turned away must not come out shorter. */
  rsv_pose pose = rsv_toy_pose;
  pose.position.easting_m -= 2, pose.yaw_rad = -0.2, pose.pitch_rad = 0.05;
  rsv_view photo = rsv_toy_see(real, &pose, 1, 1), view = rsv_toy_see(map, &pose, 1, 1);
  const rsv_pose_estimate where = {.size = sizeof where, .pose = pose};
  const rsv_comparison comparison = {sizeof comparison, 0, photo.labels, &view, &map->camera, &where};
  uint32_t width = photo.labels.width, height = photo.labels.height;
  const uint8_t *after = photo.labels.data, *before = view.labels.data;
  rsv_region region = {.size = sizeof region, .left = width, .top = height};
  for (uint32_t i = 0; i < width * height; i++) {
    if (after[i] == before[i]) continue;
    uint32_t u = i % width, v = i / width;
    region.class_before = before[i], region.class_after = after[i], region.pixels++;
    region.left = u < region.left ? u : region.left, region.right = u >= region.right ? u + 1 : region.right;
    region.top = v < region.top ? v : region.top, region.bottom = v >= region.bottom ? v + 1 : region.bottom;
  }
  uint32_t columns = region.right - region.left;
  region.mask_length = (size_t)columns * (region.bottom - region.top);
  uint8_t *mask = malloc(region.mask_length);
  for (size_t i = 0; i < region.mask_length; i++) {
    size_t at = (region.top + i / columns) * width + region.left + i % columns;
    mask[i] = after[at] != before[at];
  }
  region.mask = mask;
  rsv_toy_listen(&told);
  rsv_error error = plugin->error;
  RSV_TOY_CHECK(plugin->table.estimate(plugin->instance, &map->services, &comparison, &region, 1, sizeof region, &told.results,
                                       &error) == RSV_OK);
  RSV_TOY_CHECK(told.proposal_count == 1);
  free(mask);
  rsv_toy_forget(&photo);
  rsv_toy_forget(&view);
  return &told.proposals[0];
}

int main(void) {
  rsv_toy bare, hung;
  rsv_toy_plugin plugin;
  rsv_toy_street(&bare, 640, 480);
  rsv_toy_street(&hung, 640, 480);
  double east = rsv_toy_pose.position.easting_m - 6, north = rsv_toy_pose.position.northing_m + 10;
  rsv_toy_add_descriptor(&hung, east, north, east + 3, north, 7, 8, RSV_BANNER);
  rsv_toy_open(&plugin, &resurvey_plugin_v1__my_plugin, "{\"plane_m\":0.2,\"range_m\":50}");

  /* A banner of 3 m by 1 m is measured within two per cent. */
  const rsv_proposal *placed = estimate(&plugin, &bare, &hung);
  RSV_TOY_CHECK(placed->kind == RSV_PLACE && placed->descriptor->class_index == RSV_BANNER);
  const double(*corners)[3] = placed->descriptor->corners;
  RSV_TOY_CHECK(fabs(hypot(corners[1][0] - corners[0][0], corners[1][1] - corners[0][1]) - 3) < 0.06);
  RSV_TOY_CHECK(fabs(corners[3][2] - corners[0][2] - 1) < 0.02);
  RSV_TOY_CHECK(hypot(corners[0][0] - east, corners[0][1] - north) < 0.1 && placed->descriptor->normal[1] < -0.999);

  /* One that is gone is removed where it hung. */
  const rsv_proposal *removed = estimate(&plugin, &hung, &bare);
  RSV_TOY_CHECK(removed->kind == RSV_REMOVE && removed->class_index == RSV_BANNER);
  RSV_TOY_CHECK(hypot(removed->near_point[0] - (east + 1.5), removed->near_point[1] - north) < 0.2);

  rsv_toy_close(&plugin);
  puts("passed");
  return 0;
}
