"""python3 -m unittest"""

import unittest

from detector import MyDetector

from resurvey_plugin import toy


class TheDetector(unittest.TestCase):
    def setUp(self):
        self.world = toy.street()

    def detect(self, photo):
        return list(MyDetector(toy.settings(MyDetector)).detect(self.world.comparison(photo, toy.POSE), self.world))

    def test_equal_images_give_no_region(self):
        self.assertEqual(self.detect(self.world.view(toy.POSE).labels), [])

    def test_a_new_banner_is_one_region_where_it_is(self):
        photo = self.world.view(toy.POSE).labels.copy()
        photo[100:120, 50:90] = toy.BANNER
        region, = self.detect(photo)
        self.assertEqual((region.class_before, region.class_after), (toy.STONE, toy.BANNER))
        self.assertEqual((region.left, region.top, region.mask.shape, region.pixels), (50, 100, (20, 40), 800))

    def test_what_does_not_hang_together_is_two_regions(self):
        photo = self.world.view(toy.POSE).labels.copy()
        photo[100:120, 50:90] = toy.BANNER
        photo[100:120, 70] = toy.STONE
        self.assertEqual(sorted(region.left for region in self.detect(photo)), [50, 71])


if __name__ == "__main__":
    unittest.main()
