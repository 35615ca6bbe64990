"""The toy world against numbers worked out by hand."""

import unittest

import numpy as np

from resurvey_plugin import DynamicDescriptor, Pose, toy


class TheToyWorld(unittest.TestCase):
    def test_a_wall_ten_metres_ahead_is_seen_where_the_pinhole_says(self):
        scene = toy.Scene()
        scene.add_wall((-1.0, 10.0), (1.0, 10.0), (4.0, 6.0), toy.STONE)
        view = toy.ToyHost(scene, toy.Camera("pinhole", 100, 100, 100.0, 100.0, 50.0, 50.0)).view(Pose(0.0, 0.0, 5.0))
        rows, columns = np.nonzero(view.labels == toy.STONE)
        # 2 m at 10 m through a focal length of 100 px: 20 px around the middle.
        self.assertEqual((rows.min(), rows.max(), columns.min(), columns.max()), (40, 59, 40, 59))
        self.assertAlmostEqual(float(view.range_m[50, 50]), 10.0 * np.sqrt(1 + 2 * 0.005**2), places=5)
        self.assertTrue(np.isinf(view.range_m[0, 0]) and np.isnan(view.points[0, 0]).all())

    def test_yaw_is_clockwise_pitch_is_up_and_roll_is_right_side_down(self):
        host = toy.ToyHost(toy.Scene(), toy.Camera("pinhole", 100, 100, 100.0, 100.0, 50.0, 50.0))
        east, up, right_down = (host.pixel_rays(Pose(0, 0, 0, *angles), [pixel])[0] for angles, pixel in (
            ((np.pi / 2, 0, 0), (50, 50)), ((0, np.pi / 2, 0), (50, 50)), ((0, 0, np.pi / 2), (150, 50))))
        np.testing.assert_allclose(east, (1, 0, 0), atol=1e-12)
        np.testing.assert_allclose(up, (0, 0, 1), atol=1e-12)
        np.testing.assert_allclose(right_down, np.array((0, 1, -1)) / np.sqrt(2), atol=1e-12)

    def test_projecting_undoes_pixel_rays(self):
        host, pose = toy.street(), Pose(10.0, 20.0, 3.0, 0.7, -0.2, 0.1)
        pixels = np.array([[0.5, 0.5], [160.0, 20.0], [311.0, 239.5]])
        points = pose.position + 7.0 * host.pixel_rays(pose, pixels)
        np.testing.assert_allclose(host.project(pose, points), pixels, atol=1e-9)
        self.assertTrue(np.isnan(host.project(pose, pose.position - host.pixel_rays(pose, pixels))).all())

    def test_a_descriptor_stands_before_its_wall_and_names_itself(self):
        host = toy.street()
        fid = host.scene.add_descriptor(toy.banner())
        with_it, without = host.view(toy.POSE), host.view(toy.POSE, with_descriptors=False)
        changed = with_it.labels != without.labels
        self.assertTrue((with_it.labels[changed] == toy.BANNER).all() and (without.labels[changed] == toy.STONE).all())
        self.assertTrue((with_it.features[changed] == 1).all())
        self.assertEqual(with_it.feature_table["fid"].tolist(), [fid])
        hit = host.cast_rays(toy.POSE.position, [toy.banner().corners.mean(axis=0) - toy.POSE.position])[0]
        self.assertEqual((hit["fid"], hit["has_fid"], hit["class"]), (fid, 1, toy.BANNER))
        np.testing.assert_allclose(hit["normal"], (0, -1, 0), atol=1e-12)

    def test_a_chair_stands_on_the_ground(self):
        host = toy.street()
        chair = DynamicDescriptor(toy.CHAIR, toy.POSE.position + (0, 5.0, -1.6), np.array([0.5, 0.5, 0.9]))
        fid = host.scene.add_descriptor(chair)
        self.assertEqual(host.ground_height(toy.POSE.position), 4.0)
        self.assertEqual([near for near, _ in host.descriptors_near(chair.position, 0.1)], [fid])
        top = host.project(toy.POSE, [chair.position + (0, -0.25, 0.9)])[0]
        self.assertEqual(host.view(toy.POSE).labels[int(top[1]) + 1, int(top[0])], toy.CHAIR)


if __name__ == "__main__":
    unittest.main()
