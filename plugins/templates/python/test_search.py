"""python3 -m unittest"""

import unittest

import numpy as np
from search import MyMatcher

from resurvey_plugin import Cancelled, Failed, Photo, Prior, toy


class TheMatcher(unittest.TestCase):
    def setUp(self):
        self.world = toy.street(96, 72)
        pose = toy.POSE._replace(easting_m=toy.POSE.easting_m + 1.0, yaw_rad=np.radians(4), pitch_rad=0.02)
        # The phone believes to be elsewhere.
        self.photo = self.world.photo(pose, Prior(toy.POSE, 1.5, 0.1, np.radians(4), 0.02))
        self.truth = pose
        self.matcher = MyMatcher(toy.settings(MyMatcher, step_m=1.5, reach=1.5))

    def test_the_pose_of_the_photo_is_found(self):
        found = self.matcher.search(self.photo, self.world)
        off_m = np.hypot(found.pose.easting_m - self.truth.easting_m, found.pose.northing_m - self.truth.northing_m)
        self.assertLess(off_m, 0.5)
        self.assertLess(abs(np.degrees(found.pose.yaw_rad - self.truth.yaw_rad)), 1.5)
        self.assertGreater(found.score, 0.95)
        self.assertTrue((np.linalg.eigvalsh(found.covariance) > 0).all())

    def test_a_photo_without_labels_has_no_answer(self):
        with self.assertRaises(Failed):
            self.matcher.search(Photo(np.full_like(self.photo.labels, 255), self.photo.camera, self.photo.prior), self.world)

    def test_it_ends_when_it_is_cancelled(self):
        self.world.is_cancelled = True
        with self.assertRaises(Cancelled):
            self.matcher.search(self.photo, self.world)


if __name__ == "__main__":
    unittest.main()
