"""Times Open3D's RaycastingScene on the scene and camera that the benchmark writes: class and depth of one image.

Arguments: triangles (f32, nine a triangle), a class per triangle (u8), rays (f32, origin and direction, row by row).
"""

import sys
import time

import numpy as np
import open3d as o3d

corners = np.fromfile(sys.argv[1], dtype=np.float32).reshape(-1, 3)
classes = np.fromfile(sys.argv[2], dtype=np.uint8)
rays = o3d.core.Tensor(np.fromfile(sys.argv[3], dtype=np.float32).reshape(-1, 6))
scene = o3d.t.geometry.RaycastingScene()
scene.add_triangles(
    o3d.core.Tensor(corners), o3d.core.Tensor(np.arange(len(corners), dtype=np.uint32).reshape(-1, 3))
)
table = np.append(classes, 255)
best_s = float("inf")
for _ in range(7):
    before = time.perf_counter()
    hit = scene.cast_rays(rays)
    ids = hit["primitive_ids"].numpy()
    labels = table[np.minimum(ids, len(classes))]
    depths = hit["t_hit"].numpy()
    best_s = min(best_s, time.perf_counter() - before)
print(f"{best_s * 1e3:.1f}")
