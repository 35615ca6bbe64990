"""python3 -m unittest"""

import unittest

import numpy as np
from matcher import MyMatcher

from resurvey_plugin import Failed, toy


class TheMatcher(unittest.TestCase):
    def setUp(self):
        self.matcher = MyMatcher(toy.settings(MyMatcher))
        self.world = toy.street()

    def test_the_true_pose_scores_best(self):
        photo = self.world.photo(toy.POSE)
        poses = [toy.POSE._replace(easting_m=toy.POSE.easting_m + aside_m) for aside_m in (0.0, 0.5, 1.0)]
        scores = [self.matcher.score(photo.labels, view) for view in self.world.render(poses)]
        self.assertEqual(scores[0], 1.0)
        self.assertGreater(scores[0], scores[1])
        self.assertGreater(scores[1], scores[2])

    def test_a_photo_without_labels_has_no_answer(self):
        view = self.world.view(toy.POSE)
        with self.assertRaises(Failed):
            self.matcher.score(np.full_like(view.labels, 255), view)


if __name__ == "__main__":
    unittest.main()
