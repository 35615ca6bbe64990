"""A descriptor estimator: what does each region mean for the map? This one measures rectangles on upright walls, and says of
everything else which requirement it missed, and by what.

Build: python3 -m resurvey_plugin build estimator.py
Check: resurvey plugins check resurvey-plugin-my-plugin
"""

import numpy as np

from resurvey_plugin import MaterialDescriptor, Place, Plugin, Reject, Remove, main


class MyEstimator(Plugin):
    NAME = "my-plugin"
    VERSION = "0.1.0"
    SUMMARY = "Measures rectangles on upright walls"
    SETTINGS = {
        "plane_m": {"type": "number", "default": 0.2, "minimum": 0, "maximum": 10,
                    "description": "largest distance of a point of the region from its plane, metres"},
        "range_m": {"type": "number", "default": 50, "minimum": 1, "maximum": 1000,
                    "description": "largest distance from the camera, metres"},
    }

    def estimate(self, comparison, regions, host):
        for index, region in enumerate(regions):
            host.check_cancelled()
            yield self.meaning(index, region, comparison, host)

    def meaning(self, index, region, comparison, host):
        view, inside = comparison.view, region.mask == 1
        points = view.points[region.rows_and_columns][inside].astype(float)
        known = np.isfinite(points[:, 0])
        gone = points[self.shown(region, view)[inside] & known]
        points = points[known]
        if 2 * len(gone) > region.pixels:
            return Remove(index, region.class_before, view.origin + gone.mean(axis=0), sigma_m=0.5)
        if region.class_after not in [one.index for one in host.classes if one.kind == "material"]:
            return Reject(index, "material-class", 0, 1, "material")
        share = len(points) / region.pixels
        if share < 0.9 or len(points) < 3:
            return Reject(index, "on-a-surface", share, 0.9, "ratio")
        (top, left), (height, width) = (region.top, region.left), region.mask.shape
        rows, columns = comparison.photo.shape
        edge_px = min(left, top, columns - left - width, rows - top - height)
        if edge_px < 1:
            return Reject(index, "captured-entirely", edge_px, 1, "px")
        return self.measured(index, region, points, comparison)

    def shown(self, region, view):
        """Where the view shows a descriptor of the region's class."""
        classes = np.append(-1, view.feature_table["class"].astype(int))
        return classes[view.features[region.rows_and_columns]] == region.class_before

    def measured(self, index, region, points, comparison):
        middle = points.mean(axis=0)
        back = comparison.estimate.pose.position - comparison.view.origin - middle
        range_m = np.linalg.norm(back)
        if range_m > self.settings.range_m:
            return Reject(index, "within-range", range_m, self.settings.range_m, "m")
        # The direction in which the points vary least is the normal of their plane.
        normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
        normal *= np.sign(normal @ back) or 1.0
        off_m = np.abs((points - middle) @ normal).max()
        if off_m > self.settings.plane_m:
            return Reject(index, "coplanar", off_m, self.settings.plane_m, "m")
        lean_deg = np.degrees(np.arcsin(min(1.0, abs(normal[2]))))
        if lean_deg > 10:
            return Reject(index, "upright", lean_deg, 10, "deg")

        # On the wall: along to the right as seen from outside, up.
        normal = np.array([normal[0], normal[1], 0.0]) / np.hypot(normal[0], normal[1])
        along, up = np.array([-normal[1], normal[0], 0.0]), np.array([0.0, 0.0, 1.0])
        area_m2 = self.areas_m2(points, normal, comparison)
        on_wall = np.stack([points @ along, points @ up], axis=1)
        centre = np.average(on_wall, axis=0, weights=area_m2)
        # A rectangle of width w has the variance w²/12: exact to a fraction of a pixel, where the outermost pixels are not.
        width_m, height_m = np.sqrt(12 * np.average((on_wall - centre) ** 2, axis=0, weights=area_m2))
        off = abs(area_m2.sum() / (width_m * height_m) - 1) if width_m * height_m else 1.0
        if off > 0.15:
            return Reject(index, "rectangle", off, 0.15, "ratio")
        foot = comparison.view.origin + (normal @ middle) * normal
        corners = [foot + (centre[0] + s * width_m) * along + (centre[1] + h * height_m) * up
                   for s, h in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
        covariance = comparison.estimate.covariance
        pixel_m = np.sqrt(area_m2.mean())
        position_m = np.sqrt(covariance[0, 0] + covariance[1, 1] + pixel_m**2)
        return Place(index, MaterialDescriptor(region.class_after, corners, normal, (position_m, pixel_m, None)))

    def areas_m2(self, points, normal, comparison):
        """How much of the plane each pixel covers: depth³ over focal lengths and distance of the plane."""
        pose, camera = comparison.estimate.pose, comparison.camera
        to_points = points + comparison.view.origin - pose.position
        forward = np.array([np.sin(pose.yaw_rad) * np.cos(pose.pitch_rad), np.cos(pose.yaw_rad) * np.cos(pose.pitch_rad),
                            np.sin(pose.pitch_rad)])
        return (to_points @ forward) ** 3 / (camera.fx * camera.fy * np.abs(to_points @ normal).mean())


if __name__ == "__main__":
    main(MyEstimator)
