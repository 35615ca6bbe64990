"""Plugins in processes of their own, over the wire."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from resurvey_plugin import Failed, Pose, Region, toy
from resurvey_plugin.plugin import Settings

from .fake import PACKAGE, FakeHost, python

HEAD = '''
import numpy as np
from resurvey_plugin import *
class Plug(Plugin):
    NAME, VERSION, SUMMARY = "plug", "1.0.0", "A plugin of the tests"
    SETTINGS = {"void": {"type": "integer", "default": 255}}
'''
SCORER = HEAD + '''
    def score(self, photo, view):
        compared = photo != self.settings.void
        if not compared.any():
            raise Failed("every pixel of the photo is void")
        return (photo == view.labels)[compared].mean()
main(Plug)
'''
ELSEWHERE = Pose(toy.POSE.easting_m + 1.0, toy.POSE.northing_m, toy.POSE.height_m)


def started(body, world=None):
    """A host with a plugin that has said hello and has been created."""
    host = FakeHost(python(body if body.startswith("\nimport") else HEAD + body + "\nmain(Plug)\n"), world)
    assert host.raw()[0] == "hello"
    assert host.create({"void": 255}) == ("done", {})
    return host


class AMatcherThatScores(unittest.TestCase):
    def test_hello_says_what_the_class_says(self):
        with FakeHost(python(SCORER)) as host:
            name, words = host.raw()
            schema = json.loads(words.pop("settings_schema"))
            self.assertEqual((name, words), ("hello", {
                "wire": 1, "kind": "matcher", "name": "plug", "version": "1.0.0", "summary": "A plugin of the tests",
                "form": "score"}))
            self.assertEqual(schema["properties"], {"void": {"type": "integer", "default": 255}})

    def test_it_scores_a_batch_and_counts_each_view(self):
        world = toy.street()
        photo, views = world.photo(toy.POSE).labels, [world.view(pose) for pose in (toy.POSE, ELSEWHERE)]
        with started(SCORER, world) as host:
            answer, scores = host.score(photo, views)
            self.assertEqual(answer, ("done", {}))
            self.assertEqual(scores.tolist(), [1.0, (photo == views[1].labels).mean()])
            self.assertEqual(int.from_bytes(host.memory[16:20], "little"), 2)

    def test_padded_rows_give_the_same_scores(self):
        world = toy.street(40, 30)
        photo, views = world.photo(toy.POSE).labels, [world.view(ELSEWHERE)]
        with started(SCORER, world) as host:
            self.assertEqual(host.score(photo, views)[1].tolist(), host.score(photo, views, padding=7)[1].tolist())

    def test_batches_sent_ahead_are_answered_in_order(self):
        world = toy.street(40, 30)
        photo, views = world.photo(toy.POSE).labels, [world.view(toy.POSE)]
        with started(SCORER, world) as host:
            value = {"photo": host.lend(photo), "views": host.stack(views)}
            places = [host.lend(np.full(1, np.nan)) for _ in range(2)]
            for scores in places:
                host.send("score", {**value, "scores": scores, "memory": host.size})
            self.assertEqual([host.raw(), host.raw()], [("done", {})] * 2)
            self.assertEqual([host.read(scores)[0] for scores in places], [1.0, 1.0])

    def test_no_answer_is_told_and_the_next_call_is_served(self):
        world = toy.street(40, 30)
        view = world.view(toy.POSE)
        with started(SCORER, world) as host:
            answer, _ = host.score(np.full_like(view.labels, 255), [view])
            self.assertEqual(answer, ("failed", {"text": "every pixel of the photo is void"}))
            self.assertEqual(host.score(view.labels, [view])[1].tolist(), [1.0])

    def test_a_cancel_ends_the_batch(self):
        world = toy.street(40, 30)
        view = world.view(toy.POSE)
        with started(SCORER, world) as host:
            host.memory[8] = 1
            self.assertEqual(host.score(view.labels, [view])[0], ("cancelled", {}))

    def test_the_next_instance_gets_its_own_settings(self):
        world = toy.street(40, 30)
        view = world.view(toy.POSE)
        half = view.labels.copy()
        half[:, :20] = 7
        with started(SCORER, world) as host:
            self.assertLess(host.score(half, [view])[1][0], 1.0)
            self.assertEqual(host.ask("destroy", {}), ("done", {}))
            self.assertEqual(host.create({"void": 7}), ("done", {}))
            self.assertEqual(host.score(half, [view])[1][0], 1.0)


class WhatGoesWrong(unittest.TestCase):
    def test_an_exception_is_told_with_file_and_line_and_the_traceback_is_kept(self):
        source = HEAD + "    def score(self, photo, view):\n        return 1 / 0\nmain(Plug)\n"
        world = toy.street(40, 30)
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "broken.py")
            with open(path, "w", encoding="utf-8") as file:
                file.write(source)
            host = FakeHost([sys.executable, path], world)
            host.raw(), host.create({"void": 1})
            answer, _ = host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])
            self.assertEqual(answer, ("panicked", {"text": "ZeroDivisionError: division by zero (broken.py:8)"}))
            code, last_words = host.close()
        self.assertEqual(code, 0)
        self.assertIn("Traceback", last_words)

    def test_a_text_that_is_no_unicode_leaves_the_wire_whole(self):
        world = toy.street(40, 30)
        with started("    def score(self, photo, view):\n        raise Failed('weights ' + chr(0xDC80))\n", world) as host:
            answer, _ = host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])
            self.assertEqual(answer, ("failed", {"text": "weights ?"}))

    def test_prints_and_readers_leave_the_wire_alone(self):
        world = toy.street(40, 30)
        view = world.view(toy.POSE)
        host = started('''
    def score(self, photo, view):
        import os, sys
        print("to stdout")
        os.write(1, b"to descriptor 1\\n")
        assert sys.stdin.read() == ""
        return 0.5
''', world)
        self.assertEqual(host.score(view.labels, [view])[1].tolist(), [0.5])
        code, last_words = host.close()
        self.assertEqual(code, 0)
        self.assertEqual(sorted(last_words.split("\n")), ["", "to descriptor 1", "to stdout"])

    def test_what_is_lent_cannot_be_written_to(self):
        world = toy.street(40, 30)
        view = world.view(toy.POSE)
        for what in ("photo", "view.labels", "view.points", "view.range_m", "view.features", "view.origin"):
            with self.subTest(what), started(f"    def score(self, photo, view):\n        {what}[0] = 1\n", world) as host:
                name, value = host.score(view.labels, [view])[0]
                self.assertEqual(name, "panicked")
                self.assertIn("read-only", value["text"])

    def test_a_call_to_exit_is_a_bug_and_not_an_end(self):
        world = toy.street(40, 30)
        with started("    def score(self, photo, view):\n        exit(0)\n", world) as host:
            self.assertEqual(host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])[0][0], "panicked")

    def test_a_score_that_is_no_number_is_told_with_what_it_is(self):
        world = toy.street(40, 30)
        bodies = {"pass": "expected score to return a number from 0 to 1, found NoneType",
                  "return (photo == view.labels).mean(axis=0)": "found an array of shape (40,)",
                  "return 'high'": "found str"}
        for body, words in bodies.items():
            with self.subTest(body), started(f"    def score(self, photo, view):\n        {body}\n", world) as host:
                name, value = host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])[0]
                self.assertEqual(name, "panicked")
                self.assertIn(words, value["text"])

    def test_what_is_no_region_or_proposal_is_told_with_what_it_is(self):
        world = toy.street(40, 30)
        photo = world.photo(toy.POSE).labels
        calls = {"detect(self, comparison, host)": "Region", "estimate(self, comparison, regions, host)": "Reject"}
        for call, what in calls.items():
            for body, found in (("pass", "NoneType"), ("return [comparison.photo != 3]", "ndarray"), ("return 7", "int")):
                with self.subTest(call=call, body=body), started(f"    def {call}:\n        {body}\n", world) as host:
                    name, value = host.detect(photo, toy.POSE) if "detect" in call else host.estimate(photo, toy.POSE, [])
                    self.assertEqual((name, host.taken), ("panicked", []))
                    self.assertIn(what, value["text"])
                    self.assertIn(f"found {found}", value["text"])

    def test_a_mask_that_is_larger_than_the_photo_touches_no_memory(self):
        world = toy.street(40, 30)
        body = "    def detect(self, comparison, host):\n        return [Region(0, 1, 0, 0, np.ones((3000, 3000)))]\n"
        with started(body, world) as host:
            name, value = host.detect(world.photo(toy.POSE).labels, toy.POSE)
            self.assertEqual(name, "panicked")
            self.assertIn("expected a mask within the photo of 30 × 40 pixels, found 3000 × 3000", value["text"])

    def test_an_author_s_own_init_has_the_settings_too(self):
        world = toy.street(40, 30)
        with started('''
    def __init__(self, settings):
        self.half = 0.5
    def score(self, photo, view):
        return self.half * self.settings.void / 255
''', world) as host:
            self.assertEqual(host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])[1].tolist(), [0.5])

    def test_classes_that_cannot_be_are_not_ignored_in_silence(self):
        world = toy.street(40, 30)
        body = "    def search(self, photo, host):\n        host.compare_views([photo.prior.pose], ignored_in_photo=[300])\n"
        with started(body, world) as host:
            name, value = host.search(world.photo(toy.POSE))
            self.assertIn("expected indices of classes from 0 to 254, found 300", value["text"])

    def test_settings_that_the_class_does_not_have_are_named(self):
        world = toy.street(40, 30)
        with started("    def score(self, photo, view):\n        return self.settings.viod\n", world) as host:
            name, value = host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])[0]
            self.assertEqual(name, "panicked")
            self.assertIn("no setting 'viod' in SETTINGS; there are void", value["text"])

    def test_started_by_hand_it_says_what_it_is(self):
        run = subprocess.run(python(SCORER), env={**os.environ, "PYTHONPATH": PACKAGE}, capture_output=True, text=True)
        self.assertEqual(run.returncode, 1)
        self.assertIn("plug is a plugin: the host starts it", run.stderr)

    def test_a_class_of_no_kind_or_of_two_is_refused(self):
        for body in ("    pass", "    def score(self, photo, view): ...\n    def detect(self, comparison, host): ..."):
            run = subprocess.run(python(HEAD + body + "\nmain(Plug)\n"), env={**os.environ, "PYTHONPATH": PACKAGE},
                                 capture_output=True, text=True)
            self.assertIn("Plug needs score, search, detect, estimate or segment, found", run.stderr)


class AMatcherThatSearches(unittest.TestCase):
    def test_services_answer_as_the_world_does(self):
        world = toy.street(40, 30)
        world.scene.add_descriptor(toy.banner())
        with started('''
    def search(self, photo, host):
        from resurvey_plugin import toy
        world, pose = toy.street(40, 30), photo.prior.pose
        world.scene.add_descriptor(toy.banner())
        poses = [pose, pose._replace(easting_m=pose.easting_m + 1), pose._replace(yaw_rad=0.1)]
        for ours, theirs in zip(host.render(poses, stride=2), world.render(poses, 2)):
            assert all(np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in zip(ours[:5], theirs[:5]))
            assert ours.feature_table["fid"].tolist() == [1] and ours.feature_table["class"].tolist() == [toy.BANNER]
        world.photo(pose)
        same = dict(ignored_in_view=[toy.SKY], ignored_in_photo=[toy.OTHERS])
        assert np.array_equal(host.compare_views(poses, **same), world.compare_views(poses, **same))
        rays = host.pixel_rays(pose, [[20, 15], [1, 1]])
        assert np.array_equal(rays, world.pixel_rays(pose, [[20, 15], [1, 1]]))
        hits = host.cast_rays(pose.position, rays)
        assert hits["hit"].tolist() == [1, 0] and np.allclose(host.project(pose, hits["point"][:1]), [[20, 15]])
        assert host.cast_rays(pose.position, rays, limit_m=1.0)["hit"].tolist() == [0, 0]
        assert host.inside_solid([pose.position] * 3).tolist() == [False] * 3
        (fid, near), = host.descriptors_near(toy.banner().corners[0], 2.0)
        assert fid == 1 and near.class_index == toy.BANNER and np.array_equal(near.corners, toy.banner().corners)
        assert host.ground_height(pose.position) == 4.0
        try:
            host.grid_from_wgs84((22.3, 114.2, 5.0))
        except Failed as failure:
            host.log(str(failure), "warning")
        assert host.classes[5].name == "chair" and host.classes[5].size_m[2] == 0.9 and host.slots == 9
        host.progress(0.5)
        return Localization(pose, 0.75, np.diag([1, 1, 0.01]), runner_up=RunnerUp(3.0, 0.5), candidates=3,
                            heat=np.array([[pose.easting_m, pose.northing_m, 0.75]] * 100000))
''', world) as host:
            name, answer = host.search(world.photo(toy.POSE))
            self.assertEqual(name, "done", answer)
            self.assertEqual(answer["localization"], {
                "pose": list(toy.POSE), "score": 0.75, "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 0.01]],
                "candidates": 3, "skipped": 0, "runner_up": {"distance_m": 3.0, "score_ratio": 0.5}})
            self.assertEqual(host.noted, [
                ("log", {"level": "warning", "text": "the toy host does not offer grid_from_wgs84"}), ("progress", 0.5)])
            self.assertEqual(len(host.taken), 100_000)
            self.assertEqual(host.taken[-1], [*toy.POSE[:2], 0.75])

    def test_a_view_stays_what_it_was_while_other_services_are_used(self):
        with started('''
    def search(self, photo, host):
        from resurvey_plugin import toy
        world, pose = toy.street(40, 30), photo.prior.pose
        poses = [pose._replace(easting_m=pose.easting_m + aside) for aside in range(5)]
        for pose, view in zip(poses, host.render(poses)):
            host.pixel_rays(pose, np.full((2000, 2), 7.0))
            assert np.array_equal(view.labels, world.view(pose).labels), pose
            assert np.array_equal(view.origin, pose.position), pose
        return Localization(pose, 1.0, np.eye(3))
''', toy.street(40, 30)) as host:
            self.assertEqual(host.search(host.world.photo(toy.POSE))[0], "done")

    def test_wrong_poses_are_told_where_they_are_asked_for(self):
        with started("    def search(self, photo, host):\n        host.render([(1, 2, 3)])\n", toy.street(40, 30)) as host:
            name, value = host.search(host.world.photo(toy.POSE))
            self.assertIn("expected rows of 6 numbers", value["text"])

    def test_a_long_line_of_the_log_is_cut_and_the_wire_stays_whole(self):
        with started('''
    def search(self, photo, host):
        host.log("ä" * 2_000_000)
        return Localization(photo.prior.pose, 1.0, np.eye(3))
''', toy.street(40, 30)) as host:
            self.assertEqual(host.search(host.world.photo(toy.POSE))[0], "done")
            (_, words), = host.noted
            self.assertEqual(words["text"], "ä" * 8192)

    def test_many_rows_go_in_as_many_messages_as_the_scratch_needs(self):
        with started('''
    def search(self, photo, host):
        pixels = np.random.default_rng(1).uniform(0, 30, (200_000, 2))
        rays = host.pixel_rays(photo.prior.pose, pixels)
        assert np.allclose(host.project(photo.prior.pose, photo.prior.pose.position + rays), pixels)
        return Localization(photo.prior.pose, 1.0, np.eye(3))
''', toy.street(40, 30)) as host:
            self.assertEqual(host.search(host.world.photo(toy.POSE))[0], "done")

    def test_numbers_that_json_does_not_have_become_null(self):
        with started('''
    def search(self, photo, host):
        return Localization(photo.prior.pose, float("nan"), np.eye(3))
''', toy.street(40, 30)) as host:
            self.assertIsNone(host.search(host.world.photo(toy.POSE))[1]["localization"]["score"])

    def test_a_cancel_is_answered(self):
        with started('''
    def search(self, photo, host):
        while True:
            host.check_cancelled()
''', toy.street(40, 30)) as host:
            host.memory[8] = 1
            self.assertEqual(host.search(host.world.photo(toy.POSE)), ("cancelled", {}))


class DetectorAndEstimator(unittest.TestCase):
    def test_regions_arrive_with_their_masks(self):
        world = toy.street(80, 60)
        photo = world.photo(toy.POSE).labels.copy()
        photo[10:14, 20:27] = toy.BANNER
        photo[11, 21] = 255
        with started('''
    def detect(self, comparison, host):
        different = (comparison.photo != comparison.view.labels) & (comparison.photo != 255)
        return [Region.of(different, comparison.view.labels[different][0], comparison.photo[different][0])] * 1200
''', world) as host:
            self.assertEqual(host.detect(photo, toy.POSE), ("done", {}))
            self.assertEqual(len(host.taken), 1200)
            last = host.taken[-1]
            self.assertEqual((last["class_after"], last["bounds"], last["pixels"]), (toy.BANNER, [20, 10, 27, 14], 27))
            self.assertEqual(host.read(last["mask"]).tolist(), (photo[10:14, 20:27] == toy.BANNER).astype(int).tolist())

    def test_proposals_of_every_sort_arrive(self):
        world = toy.street(80, 60)
        mask = np.zeros((60, 80), bool)
        mask[10:14, 20:27] = True
        region = Region.of(mask, toy.STONE, toy.BANNER)
        with started('''
    def estimate(self, comparison, regions, host):
        region, = regions
        points = comparison.view.points[region.rows_and_columns]
        assert region.mask.all() and points.shape == (4, 7, 3) and comparison.estimate.pose.height_m == 5.6
        corners = comparison.view.origin + points[[-1, -1, 0, 0], [0, -1, -1, 0]]
        return [Place(0, MaterialDescriptor(region.class_after, corners, [0, -1, 0], sigma=(0.25, 0.125, None))),
                Place(0, DynamicDescriptor(5, corners[0], [0.5, 0.5, 0.9], yaw_rad=1.25)),
                Remove(0, 5, corners[0], 0.5), Reject(0, "within-range", 61.5, 50.0, "m")]
''', world) as host:
            self.assertEqual(host.estimate(world.view(toy.POSE).labels, toy.POSE, [region]), ("done", {}))
            material, dynamic, remove, reject = host.taken
            self.assertEqual(material["place"]["descriptor"]["material"]["sigma"], [0.25, 0.125, None])
            corner = material["place"]["descriptor"]["material"]["corners"][0]
            self.assertAlmostEqual(corner[1], toy.POSE.northing_m + 10.0, places=3)
            self.assertEqual(dynamic["place"]["descriptor"]["dynamic"], {
                "class": 5, "position": corner, "size_m": [0.5, 0.5, 0.9], "yaw_rad": 1.25, "sigma": None})
            self.assertEqual(remove, {"remove": {"region": 0, "class": 5, "near": corner, "sigma_m": 0.5}})
            self.assertEqual(reject["reject"], {
                "region": 0, "class_before": toy.STONE, "class_after": toy.BANNER, "pixels": 28,
                "requirement": "within-range", "measured": 61.5, "limit": 50.0, "unit": "m"})

    def test_a_call_without_results_sends_none(self):
        world = toy.street(40, 30)
        with started("    def estimate(self, comparison, regions, host):\n        return []\n", world) as host:
            self.assertEqual(host.estimate(world.view(toy.POSE).labels, toy.POSE, []), ("done", {}))
            self.assertEqual(host.taken, [])


class ASegmenter(unittest.TestCase):
    def segment(self, body, world=None):
        world = world or toy.street(40, 30)
        with started("    def segment(self, photo, host):\n        " + body + "\n", world) as host:
            return host.segment(world.picture(toy.POSE))

    def test_labels_of_any_whole_type_arrive(self):
        world = toy.street(40, 30)
        nearest = ("colours = np.array([one.colour for one in host.classes])\n        "
                   "return np.abs(photo[:, :, None].astype(int) - colours).sum(axis=-1).argmin(axis=-1)")
        answer, labels = self.segment(nearest, world)
        self.assertEqual(answer, ("done", {}))
        np.testing.assert_array_equal(labels, world.view(toy.POSE).labels)

    def test_what_is_no_image_of_labels_is_told(self):
        for body, words in (("return photo", "shape (30, 40, 3)"), ("return photo[:-1, :, 0]", "shape (29, 40)"),
                            ("return photo[..., 0] / 255", "type float64"), ("return None", "type object"),
                            ("return np.full((30, 40), -1)", "found -1 to -1"), ("return np.full((30, 40), 256)", "256")):
            with self.subTest(body):
                (name, value), labels = self.segment(body)
                self.assertEqual(name, "panicked")
                self.assertIn(words, value["text"])
                self.assertTrue((labels == 255).all())

    def test_the_photo_cannot_be_written_to_and_there_is_no_map(self):
        self.assertIn("read-only", self.segment("photo[0] = 1")[0][1]["text"])
        answer, _ = self.segment("host.ground_height((0, 0, 0))")
        self.assertEqual(answer[0], "failed")
        self.assertIn("a segmenter has no map", answer[1]["text"])


class Records(unittest.TestCase):
    def test_a_setting_may_be_called_as_what_a_dict_has(self):
        settings = Settings({"items": 3, "values": 0.5, "get": "a"})
        self.assertEqual((settings.items, settings.values, settings.get, settings["items"]), (3, 0.5, "a", 3))
        self.assertEqual({**settings}, {"items": 3, "values": 0.5, "get": "a"})
        self.assertEqual(sorted(Settings({"void": 1}).items()), [("void", 1)])

    def test_a_region_of_parts_has_all_its_pixels(self):
        region = Region.of(np.array([[0.0, 0.25], [0.0, 1.0]]), 0, 1)
        self.assertEqual((region.pixels, region.left, region.mask.dtype), (2, 1, np.uint8))
        with self.assertRaisesRegex(ValueError, "expected a mask of rows and columns"):
            Region.of(np.ones(7), 0, 1)

    def test_a_class_is_found_by_its_name(self):
        world = toy.street(40, 30)
        self.assertEqual(world.class_named("banner").index, toy.BANNER)
        with self.assertRaisesRegex(Failed, "expected a map with a class tree, found stone, glass"):
            world.placeless().class_named("tree")
        with started("    def search(self, photo, host):\n        raise Failed(host.class_named('chair').kind)\n", world) as host:
            self.assertEqual(host.search(world.photo(toy.POSE)), ("failed", {"text": "dynamic"}))


class TheOneFile(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.directory = place.name

    def write(self, name, source):
        path = os.path.join(self.directory, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(source)
        return path

    def build(self, source, *options, name="plug.py", python=sys.executable):
        # A virtual environment made in another one does not have its NumPy.
        paths = os.pathsep.join([PACKAGE, os.path.dirname(os.path.dirname(np.__file__))])
        return subprocess.run([python, "-m", "resurvey_plugin", "build", *options, self.write(name, source)],
                              capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths})

    def built(self, source, *options):
        run = self.build(source, *options)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run.stdout.strip()

    def refusal(self, source, *options, name="plug.py"):
        run = self.build(source, *options, name=name)
        self.assertEqual((run.returncode, "Traceback" in run.stderr), (1, False), run.stderr)
        return run.stderr

    def score_alone(self, built):
        """What the file scores where nothing else of the author's is."""
        world = toy.street(40, 30)
        with tempfile.TemporaryDirectory() as elsewhere:
            path = os.path.join(elsewhere, os.path.basename(built))
            os.rename(built, path)
            with FakeHost([sys.executable, path], package=elsewhere) as host:
                self.assertEqual(host.raw()[0], "hello")
                self.assertEqual(host.create(), ("done", {}))
                answer, scores = host.score(world.view(toy.POSE).labels, [world.view(toy.POSE)])
                self.assertEqual(answer, ("done", {}))
                return scores[0]

    def test_it_runs_alone_and_declares_itself_before_it_runs(self):
        path = self.built(SCORER.replace("\nmain(", "\nif __name__ == '__main__':\n    main("))
        with open(path, "rb") as file:
            file.readline()
            second = file.readline()
        declared = json.loads(second.replace(b"# resurvey-plugin: ", b""))
        os.remove(os.path.join(self.directory, "plug.py"))
        with FakeHost([sys.executable, path], package=self.directory) as host:
            said = host.raw()[1]
            self.assertEqual({key: said[key] for key in declared}, declared)
            self.assertEqual(host.create({"void": 255}), ("done", {}))

    def test_the_same_source_gives_the_same_bytes(self):
        files = []
        for _ in range(2):
            with open(self.built(SCORER.replace("main(Plug)", "")), "rb") as file:
                files.append(file.read())
        self.assertEqual(files[0], files[1])

    def test_a_dataclass_with_postponed_annotations_is_built(self):
        source = ("from __future__ import annotations\nfrom dataclasses import dataclass\nimport typing\n"
                  "@dataclass\nclass Weights:\n    half: typing.ClassVar[float] = 0.5\n    more: float = 0.25\n" + HEAD +
                  "    def score(self, photo, view):\n        return Weights().more + Weights.half\n")
        self.assertEqual(self.score_alone(self.built(source)), 0.75)

    def test_a_class_that_others_are_made_from_is_no_second_plugin(self):
        source = HEAD.replace("class Plug(Plugin)", "class Base(Plugin)") + (
            "    def score(self, photo, view):\n        return self.VALUE\n"
            "class Plug(Base):\n    NAME, VALUE = 'plug-two', 0.25\n")
        path = self.built(source)
        self.assertEqual(os.path.basename(path), "resurvey-plugin-plug-two")
        self.assertEqual(self.score_alone(path), 0.25)

    def test_modules_beside_it_that_it_imports_go_along(self):
        self.write("weights.py", "HALF = 0.5\n")
        self.write("model/__init__.py", "")
        self.write("model/net.py", "from weights import HALF\ndef run():\n    return HALF / 2\n")
        body = "    def score(self, photo, view):\n        return model.net.run()\n"
        run = self.build("import model.net\n" + HEAD + body)
        self.assertEqual(run.stderr, "with model/__init__.py, model/net.py, weights.py\n")
        self.assertEqual(self.score_alone(run.stdout.strip()), 0.25)

    def test_modules_that_are_imported_later_are_named(self):
        self.write("late.py", "VALUE = 0.125\n")
        source = HEAD + "    def score(self, photo, view):\n        import late\n        return late.VALUE\n"
        self.assertEqual(self.score_alone(self.built(source, "--with", os.path.join(self.directory, "late.py"))), 0.125)
        self.assertIn("expected a Python file below", self.refusal(source, "--with", __file__))

    def test_a_virtual_environment_builds_for_itself(self):
        subprocess.run([sys.executable, "-m", "venv", "--without-pip",
                        os.path.join(self.directory, "venv")], check=True)
        python = os.path.join(self.directory, "venv", "bin", "python3")
        run = self.build(SCORER.replace("main(Plug)", ""), python=python)
        with open(run.stdout.strip(), "rb") as file:
            self.assertEqual(file.readline().decode(), f"#!{python}\n")

    def test_an_interpreter_that_no_first_line_can_name_is_refused(self):
        spaced = os.path.join(self.directory, "my python")
        os.symlink(sys.executable, spaced)
        self.assertIn("expected an interpreter without spaces in its path", self.refusal(SCORER, "--python", spaced))
        self.assertIn("expected the path of an interpreter", self.refusal(SCORER, "--python", "/no/python3"))

    def test_what_is_no_one_plugin_is_refused(self):
        self.assertIn("expected one class made from Plugin that has a NAME, found none", self.refusal("x = 1\n"))
        two = HEAD + "    def score(self, photo, view): ...\nclass Other(Plugin):\n    NAME = 'other'\n"
        self.assertIn("found Plug, Other", self.refusal(two))
        self.assertIn("below if __name__ ==", self.refusal(SCORER))
        self.assertIn("json.py hides a module", self.refusal(SCORER, name="json.py"))


if __name__ == "__main__":
    unittest.main()
