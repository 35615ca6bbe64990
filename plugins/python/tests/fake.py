"""A small host that starts a plugin and speaks the wire with it, on the toy world."""

import json
import mmap
import os
import socket
import subprocess
import sys

import numpy as np

from resurvey_plugin import Failed, toy, words

PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
HEADER = 4096
SCRATCH = 1 << 20
LONGEST_LINE = 1 << 20


class FakeHost:
    """The wire to one plugin process."""

    def __init__(self, program, world=None, package=PACKAGE):
        self.world = world or toy.street()
        self.file = os.memfd_create("memory")
        os.ftruncate(self.file, HEADER)
        self.memory = mmap.mmap(self.file, HEADER)
        self.memory[:8] = b"RSVWIRE1"
        self.size = HEADER
        self.mark = None
        ours, theirs = socket.socketpair()
        ours.settimeout(20)
        environment = {**os.environ, "PYTHONPATH": package}
        self.process = subprocess.Popen(program, stdin=self.file, stdout=theirs, stderr=subprocess.PIPE, env=environment)
        theirs.close()
        self.wire = ours
        self.lines = ours.makefile("rb")
        self.noted = []
        self.taken = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Ends the wire; gives exit code and last words."""
        self.wire.shutdown(socket.SHUT_RDWR)
        self.lines.close()
        self.wire.close()
        _, last_words = self.process.communicate(timeout=20)
        return self.process.returncode, last_words.decode()

    def send(self, name, value):
        self.wire.sendall(words.line(name, value))

    def raw(self):
        """The next message, whatever it is."""
        line = self.lines.readline()
        assert len(line) <= LONGEST_LINE, f"a line of {len(line)} bytes"
        (name, value), = json.loads(line).items()
        return name, value

    def ask(self, call, value):
        """Sends a call and answers requests until it ends."""
        self.send(call, value)
        while True:
            name, answer = self.raw()
            if name in ("done", "failed", "panicked", "cancelled"):
                return name, answer
            self._serve(name, answer)

    def create(self, settings=None):
        return self.ask("create", {"settings": json.dumps(settings or {}, separators=(",", ":"), sort_keys=True)})

    def lend(self, array, padding=0):
        """Puts an array into the memory, which never shrinks; its rows may be `padding` values longer."""
        array = np.asarray(array)
        offset = (self.size + 63) // 64 * 64
        wide = np.zeros((*array.shape[:-1], array.shape[-1] + padding), array.dtype)
        wide[..., :array.shape[-1]] = array
        self.size = offset + wide.nbytes
        if self.size > len(self.memory):
            os.ftruncate(self.file, self.size)
            self.memory = mmap.mmap(self.file, self.size)
        self.memory[offset:offset + wide.nbytes] = wide.tobytes()
        dtype = array.dtype.str if array.dtype.fields is None else f"|V{array.dtype.itemsize}"
        return {"dtype": dtype, "shape": list(array.shape), "strides": list(wide.strides), "offset": offset}

    def read(self, array):
        """An array that the plugin sent."""
        return np.ndarray(array["shape"], array["dtype"], self.memory, array["offset"], array["strides"]).copy()

    def stack(self, views, padding=0):
        """Views as the wire has them."""
        one = {"labels": 0, "range_m": 0, "features": 0}
        stack = {name: self.lend(np.stack([getattr(view, name) for view in views]), padding) for name in one}
        stack["points"] = self.lend(np.stack([view.points for view in views]))
        stack["origins"] = self.lend(np.stack([view.origin for view in views]))
        stack["feature_table"] = self.lend(views[0].feature_table)
        return stack

    def call(self, photo, **others):
        """What search and detect have in common."""
        camera = {**vars(self.world.camera), "distortion": [0.0] * 5}
        return self._begun({"photo": self.lend(photo), "camera": camera, **others})

    def _begun(self, value):
        """A call with what all have that may use services."""
        scratch = self.lend(np.zeros(SCRATCH, "u1"))["offset"]
        classes = [{key: value for key, value in item._asdict().items() if value is not None} for item in self.world.classes]
        self.mark = self.size
        return {**value, "scratch": {"offset": scratch, "bytes": SCRATCH}, "classes": classes, "memory": self.size}

    def score(self, photo, views, padding=0):
        """Answer and scores."""
        scores = self.lend(np.full(len(views), np.nan))
        value = {"photo": self.lend(photo, padding), "views": self.stack(views, padding), "scores": scores}
        answer = self.ask("score", {**value, "memory": self.size})
        return answer, self.read(scores)

    def search(self, photo):
        prior = photo.prior
        return self.ask("search", self.call(photo.labels, prior={**vars(prior), "pose": list(prior.pose)}))

    def comparison(self, photo, pose):
        estimate = {"pose": list(pose), "covariance": np.diag([0.01, 0.01, 1e-6]).tolist(), "height_sigma_m": 0.05,
                    "tilt_sigma_rad": 0.002, "alignment": None}
        return self.call(photo, estimate=estimate, views=self.stack([self.world.view(pose)]))

    def segment(self, photo):
        """Answer and labels."""
        labels = self.lend(np.full(photo.shape[:2], 255, "u1"))
        call = self._begun({"photo": self.lend(photo), "labels": labels})
        self.world = self.world.placeless()
        answer = self.ask("segment", call)
        return answer, self.read(labels)

    def detect(self, photo, pose):
        return self.ask("detect", self.comparison(photo, pose))

    def estimate(self, photo, pose, regions):
        listed = [{"class_before": region.class_before, "class_after": region.class_after,
                   "bounds": [region.left, region.top, region.left + region.mask.shape[1], region.top + region.mask.shape[0]],
                   "pixels": region.pixels, "mask": self.lend(region.mask)} for region in regions]
        return self.ask("estimate", {"comparison": self.comparison(photo, pose), "regions": listed})

    def _serve(self, name, value):
        """Answers a request. Like the host, it takes back what it lent with the answer before."""
        if name in ("log", "progress"):
            self.noted.append((name, value))
            return
        if name in ("regions", "proposals", "heat"):
            self.taken += self.read(value["cells"]).tolist() if name == "heat" else value
            self.send("served", {"memory": self.size})
            return
        if self.mark is not None:
            self.size = self.mark
        try:
            answer = getattr(self, f"_{name}")(value)
        except Failed as failure:
            answer = str(failure)
        self.send(*(("error", {"text": answer}) if isinstance(answer, str) else ("served", {**answer, "memory": self.size})))

    def _render(self, value):
        poses = self.read(value["poses"])[:2]
        return {"views": self.stack(self.world.render(poses, value["stride"], value["with_descriptors"]))}

    def _compare_views(self, value):
        def listed(sets):
            return [index for index in range(256) if sets[index // 64] >> index % 64 & 1]

        return {"values": self.lend(self.world.compare_views(
            self.read(value["poses"]), value["stride"], listed(value["ignored_in_photo"]), listed(value["ignored_in_view"])))}

    def _pixel_rays(self, value):
        return {"values": self.lend(self.world.pixel_rays(toy.Pose(*value["pose"]), self.read(value["pixels"])))}

    def _project(self, value):
        return {"values": self.lend(self.world.project(toy.Pose(*value["pose"]), self.read(value["points"])))}

    def _inside_solid(self, value):
        return {"values": self.lend(self.world.inside_solid(self.read(value["points"])).astype("u1"))}

    def _cast_rays(self, value):
        return {"values": self.lend(self.world.cast_rays(
            value["origin"], self.read(value["directions"]), value["limit_m"], value["with_descriptors"]))}

    def _descriptors_near(self, value):
        near = self.world.descriptors_near(value["point"], value["radius_m"])
        return {"features": [{"fid": fid, "descriptor": words.descriptor(one)} for fid, one in near]}

    def _ground_height(self, value):
        height_m = self.world.ground_height(value["point"])
        return {} if height_m is None else {"height_m": height_m}

    def _grid_from_wgs84(self, value):
        return {"position": self.world.grid_from_wgs84(value["position"])}


def python(source):
    """The command that runs a plugin whose text is `source`."""
    return [sys.executable, "-c", source]
