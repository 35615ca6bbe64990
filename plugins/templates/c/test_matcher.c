/* The matcher, on the toy street of resurvey_toy.h: make test */
#include "resurvey_toy.h"

extern const rsv_declaration resurvey_plugin_v1__my_plugin;

int main(void) {
  rsv_toy street;
  rsv_toy_plugin plugin;
  rsv_toy_street(&street, 160, 120);
  rsv_toy_open(&plugin, &resurvey_plugin_v1__my_plugin, "{\"void\":255}");

  /* The true pose scores best, and the further off the worse. */
  rsv_view photo = rsv_toy_see(&street, &rsv_toy_pose, 1, 1);
  double scores[3];
  for (int i = 0; i < 3; i++) {
    rsv_pose pose = rsv_toy_pose;
    pose.position.easting_m += 0.5 * i;
    rsv_view view = rsv_toy_see(&street, &pose, 1, 1);
    RSV_TOY_CHECK(plugin.table.score(plugin.instance, &photo.labels, &view, &scores[i], &plugin.error) == RSV_OK);
    rsv_toy_forget(&view);
  }
  RSV_TOY_CHECK(scores[0] == 1 && scores[1] < scores[0] && scores[2] < scores[1]);

  /* Without labels there is no answer. */
  memset((void *)photo.labels.data, RSV_VOID, (size_t)photo.labels.height * photo.labels.row_bytes);
  rsv_view view = rsv_toy_see(&street, &rsv_toy_pose, 1, 1);
  RSV_TOY_CHECK(plugin.table.score(plugin.instance, &photo.labels, &view, scores, &plugin.error) == RSV_FAILED);
  RSV_TOY_CHECK(plugin.error.length > 0);

  rsv_toy_forget(&view);
  rsv_toy_forget(&photo);
  rsv_toy_close(&plugin);
  puts("passed");
  return 0;
}
