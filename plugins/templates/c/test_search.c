/* The search, on the toy street of resurvey_toy.h: make test */
#include "resurvey_toy.h"

extern const rsv_declaration resurvey_plugin_v1__my_plugin;

int main(void) {
  rsv_toy street;
  rsv_toy_plugin plugin;
  rsv_toy_told told;
  rsv_toy_street(&street, 96, 72);
  rsv_toy_open(&plugin, &resurvey_plugin_v1__my_plugin, "{\"reach\":1.5,\"step_m\":1.5}");
  rsv_toy_listen(&told);

  /* The phone believes to be elsewhere than where the photo was taken. */
  rsv_pose truth = rsv_toy_pose;
  truth.position.easting_m += 1, truth.yaw_rad = 0.07, truth.pitch_rad = 0.02;
  rsv_view seen = rsv_toy_see(&street, &truth, 1, 1);
  street.photo = (const uint8_t *)seen.labels.data;
  const rsv_prior prior = {sizeof prior, 0, rsv_toy_pose, 1.5, 0.1, 0.07, 0.02};
  const rsv_photo photo = {sizeof photo, 0, seen.labels, &street.camera, &prior};
  rsv_localization found = {.size = sizeof found};
  RSV_TOY_CHECK(plugin.table.search(plugin.instance, &street.services, &photo, &told.results, &found, &plugin.error) == RSV_OK);
  RSV_TOY_CHECK(hypot(found.pose.position.easting_m - truth.position.easting_m,
                      found.pose.position.northing_m - truth.position.northing_m) < 0.5);
  RSV_TOY_CHECK(fabs(found.pose.yaw_rad - truth.yaw_rad) < 0.03);
  RSV_TOY_CHECK(found.score > 0.95 && found.covariance[0] > 0 && told.heat_count > 0);

  street.is_cancelled = 1;
  RSV_TOY_CHECK(plugin.table.search(plugin.instance, &street.services, &photo, &told.results, &found, &plugin.error) ==
                RSV_CANCELLED);

  rsv_toy_forget(&seen);
  rsv_toy_close(&plugin);
  puts("passed");
  return 0;
}
