"""python3 -m unittest"""

import unittest

import numpy as np
from estimator import MyEstimator

from resurvey_plugin import Place, Region, Reject, Remove, toy

# Obliquely: a wall turned away must not come out shorter.
POSE = toy.POSE._replace(easting_m=toy.POSE.easting_m - 2.0, yaw_rad=-0.2, pitch_rad=0.05)


class TheEstimator(unittest.TestCase):
    def setUp(self):
        self.bare = toy.street(640, 480)
        self.hung = toy.street(640, 480)
        self.hung.scene.add_descriptor(toy.banner())

    def estimate(self, world, photo, before, after, pose=POSE):
        comparison = world.comparison(photo.view(pose).labels, pose)
        region = Region.of(comparison.photo != comparison.view.labels, before, after)
        proposal, = MyEstimator(toy.settings(MyEstimator)).estimate(comparison, [region], world)
        return proposal

    def test_a_banner_of_three_metres_by_one_is_measured_within_two_per_cent(self):
        proposal = self.estimate(self.bare, self.hung, toy.STONE, toy.BANNER)
        self.assertIsInstance(proposal, Place, proposal)
        a, b, _, d = proposal.descriptor.corners
        self.assertAlmostEqual(np.linalg.norm(b - a), 3.0, delta=0.02)
        self.assertAlmostEqual(np.linalg.norm(d - a), 1.0, delta=0.01)
        np.testing.assert_allclose(a, toy.banner().corners[0], atol=0.05)
        np.testing.assert_allclose(proposal.descriptor.normal, (0, -1, 0), atol=1e-3)

    def test_a_banner_that_is_gone_is_removed_where_it_hung(self):
        proposal = self.estimate(self.hung, self.bare, toy.BANNER, toy.STONE)
        self.assertIsInstance(proposal, Remove, proposal)
        np.testing.assert_allclose(proposal.near, toy.banner().corners.mean(axis=0), atol=0.2)

    def test_what_the_border_cuts_is_rejected_with_its_distance(self):
        proposal = self.estimate(self.bare, self.hung, toy.STONE, toy.BANNER, POSE._replace(yaw_rad=0.35))
        self.assertIsInstance(proposal, Reject, proposal)
        self.assertEqual((proposal.requirement, proposal.measured), ("captured-entirely", 0))


if __name__ == "__main__":
    unittest.main()
