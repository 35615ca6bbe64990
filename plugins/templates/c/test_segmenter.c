/* The segmenter, on the toy street of resurvey_toy.h: make test */
#include "resurvey_toy.h"

extern const rsv_declaration resurvey_plugin_v1__my_plugin;

int main(void) {
  rsv_toy street;
  rsv_toy_plugin plugin;
  rsv_toy_street(&street, 160, 120);
  rsv_toy_open(&plugin, &resurvey_plugin_v1__my_plugin, "{\"reach\":60}");
  rsv_view seen = rsv_toy_see(&street, &rsv_toy_pose, 1, 1);
  size_t pixels = (size_t)seen.labels.width * seen.labels.height;
  const uint8_t *truth = seen.labels.data;
  uint8_t *colours = malloc(3 * pixels), *found = malloc(pixels);
  const rsv_picture picture = {sizeof picture, 0, {colours, seen.labels.width, seen.labels.height, (size_t)3 * seen.labels.width}};
  const rsv_labels labels = {found, seen.labels.width, seen.labels.height, seen.labels.width};

  /* A picture in class colours becomes its labels, also where it is a little off. */
  for (size_t i = 0; i < 3 * pixels; i++) {
    uint8_t exact = street.classes[truth[i / 3]].colour[i % 3];
    colours[i] = exact > 245 ? exact : exact + (uint8_t)(i % 10);
  }
  RSV_TOY_CHECK(plugin.table.segment(plugin.instance, &street.services, &picture, &labels, &plugin.error) == RSV_OK);
  RSV_TOY_CHECK(!memcmp(found, truth, pixels));

  /* A colour of no class is void. */
  memset(colours, 128, 3 * pixels);
  RSV_TOY_CHECK(plugin.table.segment(plugin.instance, &street.services, &picture, &labels, &plugin.error) == RSV_OK);
  RSV_TOY_CHECK(found[0] == RSV_VOID && found[pixels - 1] == RSV_VOID);

  street.is_cancelled = 1;
  RSV_TOY_CHECK(plugin.table.segment(plugin.instance, &street.services, &picture, &labels, &plugin.error) == RSV_CANCELLED);

  free(colours);
  free(found);
  rsv_toy_forget(&seen);
  rsv_toy_close(&plugin);
  puts("passed");
  return 0;
}
