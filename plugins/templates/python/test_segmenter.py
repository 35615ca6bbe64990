"""python3 -m unittest"""

import unittest

import numpy as np
from segmenter import MySegmenter

from resurvey_plugin import VOID, Cancelled, toy


class TheSegmenter(unittest.TestCase):
    def setUp(self):
        self.segmenter = MySegmenter(toy.settings(MySegmenter))
        self.world = toy.street()

    def test_a_picture_in_class_colours_becomes_its_labels(self):
        picture, labels = self.world.picture(toy.POSE), self.world.view(toy.POSE).labels
        # A lossy picture is a little off.
        noise = np.random.default_rng(1).integers(-9, 10, picture.shape)
        noisy = np.clip(picture + noise, 0, 255).astype(np.uint8)
        np.testing.assert_array_equal(self.segmenter.segment(noisy, self.world.placeless()), labels)

    def test_a_colour_of_no_class_is_void(self):
        grey = np.full((2, 3, 3), 128, dtype=np.uint8)
        self.assertEqual(self.segmenter.segment(grey, self.world.placeless()).tolist(), [[VOID] * 3] * 2)

    def test_it_ends_when_it_is_cancelled(self):
        self.world.is_cancelled = True
        with self.assertRaises(Cancelled):
            self.segmenter.segment(self.world.picture(toy.POSE), self.world.placeless())


if __name__ == "__main__":
    unittest.main()
