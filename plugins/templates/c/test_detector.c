/* The detector, on the toy street of resurvey_toy.h: make test */
#include "resurvey_toy.h"

extern const rsv_declaration resurvey_plugin_v1__my_plugin;

int main(void) {
  rsv_toy street;
  rsv_toy_plugin plugin;
  rsv_toy_told told;
  rsv_toy_street(&street, 160, 120);
  rsv_toy_open(&plugin, &resurvey_plugin_v1__my_plugin, "{\"least_px\":100}");
  rsv_view photo = rsv_toy_see(&street, &rsv_toy_pose, 1, 1), view = rsv_toy_see(&street, &rsv_toy_pose, 1, 1);
  const rsv_pose_estimate estimate = {.size = sizeof estimate, .pose = rsv_toy_pose};
  const rsv_comparison comparison = {sizeof comparison, 0, photo.labels, &view, &street.camera, &estimate};

  /* Equal images give no region. */
  rsv_toy_listen(&told);
  RSV_TOY_CHECK(plugin.table.detect(plugin.instance, &street.services, &comparison, &told.results, &plugin.error) == RSV_OK);
  RSV_TOY_CHECK(told.region_count == 0);

  /* A new banner on the stone is one region where it is. */
  for (uint32_t v = 50; v < 60; v++) memset((uint8_t *)photo.labels.data + v * photo.labels.row_bytes + 25, RSV_BANNER, 20);
  RSV_TOY_CHECK(plugin.table.detect(plugin.instance, &street.services, &comparison, &told.results, &plugin.error) == RSV_OK);
  RSV_TOY_CHECK(told.region_count == 1 && told.regions[0].pixels == 200);
  RSV_TOY_CHECK(told.regions[0].class_before == RSV_STONE && told.regions[0].class_after == RSV_BANNER);
  RSV_TOY_CHECK(told.regions[0].left == 25 && told.regions[0].top == 50);
  RSV_TOY_CHECK(told.regions[0].right == 45 && told.regions[0].bottom == 60);

  street.is_cancelled = 1;
  RSV_TOY_CHECK(plugin.table.detect(plugin.instance, &street.services, &comparison, &told.results, &plugin.error) == RSV_CANCELLED);

  rsv_toy_drop(&told);
  rsv_toy_forget(&photo);
  rsv_toy_forget(&view);
  rsv_toy_close(&plugin);
  puts("passed");
  return 0;
}
