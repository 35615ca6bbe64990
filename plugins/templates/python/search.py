"""A matcher that searches by itself: it compares a panorama at every place of a grid with the photo, climbs from the best
headings, and says how sure it is. The host renders and counts; where to look, and what to make of the counts, is decided here.

Build: python3 -m resurvey_plugin build search.py
Check: resurvey plugins check resurvey-plugin-my-plugin
"""

import numpy as np

from resurvey_plugin import VOID, Failed, Localization, Plugin, Pose, RunnerUp, main

COLUMNS = 180
"""Of a panorama: 2° each."""
PLACES_AT_A_TIME = 16
"""A request is answered as a whole: short ones let a cancel through within 200 ms."""
SHARPNESS = 75.0
"""The likelihood of a pose is exp(SHARPNESS · score)."""
FIRST_STEPS = np.array([1.0, 1.0, 0.3, np.radians(4), np.radians(1), np.radians(1)])
HALVINGS = 5
_AXES = np.eye(6)
DIRECTIONS = np.array([sign * _AXES[axis] for axis in range(6) for sign in (-1, 1)] +
                      [there * _AXES[axis] + turn * _AXES[3] for axis in (0, 1) for there in (-1, 1) for turn in (-1, 1)])
"""Of a step of the climb: along every axis, and sideways with a turn, which nearly keeps what is ahead in its place."""


class MyMatcher(Plugin):
    NAME = "my-plugin"
    VERSION = "0.1.0"
    SUMMARY = "Compares panoramas over a grid, then climbs from the best headings"
    SETTINGS = {
        "step_m": {"type": "number", "default": 3, "minimum": 0.5, "maximum": 20,
                   "description": "distance between the places of the grid, metres"},
        "reach": {"type": "number", "default": 2.5, "minimum": 0.5, "maximum": 4,
                  "description": "how far around the prior is searched, in its sigmas"},
    }

    def search(self, photo, host):
        if (photo.labels == VOID).all():
            raise Failed("expected labels in the photo, found only void")
        # What moves hides the map: it takes no part.
        hidden = [one.index for one in host.classes if one.kind == "dynamic"]
        places, poses, scores = self.panoramas(photo.prior, host, hidden)
        stride = max(1, photo.labels.shape[1] // 240)
        climbed = [self.climb(pose, photo.prior, host, hidden, stride) for pose in apart(poses, scores)]
        climbed.sort(key=lambda found: -found[0])
        score, pose = climbed[0]
        others = [found for found in climbed if np.hypot(*(found[1] - pose)[:2]) > 2.5]
        runner_up = others and RunnerUp(float(np.hypot(*(others[0][1] - pose)[:2])), likelihood(others[0][0], score))
        return Localization(Pose(*pose), score, self.covariance(pose, score, host, hidden, stride), None, runner_up or None,
                            candidates=len(poses), heat=places)

    def panoramas(self, prior, host, hidden):
        """Places with the best score there, and all poses that were tried with their scores."""
        radius_m, step_rad = self.settings.reach * prior.position_sigma_m, 2 * np.pi / COLUMNS
        turns = min(COLUMNS // 2, int(np.ceil(self.settings.reach * prior.yaw_sigma_rad / step_rad)))
        middle = round(prior.pose.yaw_rad / step_rad)
        yaws = step_rad * np.arange(middle - turns, middle + turns + 1)
        most = int(radius_m // self.settings.step_m)
        steps = self.settings.step_m * np.arange(-most, most + 1)
        around = np.array([(east, north, 0.0) for east in steps for north in steps if np.hypot(east, north) <= radius_m])
        places = around + prior.pose.position
        places = places[~host.inside_solid(places)]
        if not len(places):
            raise Failed(f"expected a place outside of buildings within {radius_m:.0f} m of the prior, found none")
        scores = []
        for start in range(0, len(places), PLACES_AT_A_TIME):
            host.check_cancelled()
            host.progress(0.5 * start / len(places))
            scores.append(shares(host.compare_panoramas(
                places[start:start + PLACES_AT_A_TIME], columns=COLUMNS, yaw_count=len(yaws), first_yaw_rad=yaws[0],
                pitch_rad=prior.pose.pitch_rad, roll_rad=prior.pose.roll_rad, ignored_in_photo=hidden)))
        scores = np.concatenate(scores)
        tilts = (prior.pose.pitch_rad, prior.pose.roll_rad)
        poses = np.array([(*place, yaw, *tilts) for place in places for yaw in yaws])
        return np.column_stack([places[:, :2], scores.max(axis=1)]), poses, scores.ravel()

    def climb(self, pose, prior, host, hidden, stride):
        """Score and pose on top of the hill: a compass search with ever shorter steps (Hooke & Jeeves 1961)."""
        start = np.array(prior.pose)
        sigmas = np.array([np.inf, np.inf, prior.height_sigma_m, np.inf, prior.tilt_sigma_rad, prior.tilt_sigma_rad])

        def worth(poses):
            host.check_cancelled()
            scores = shares(host.compare_views(poses, stride=stride, ignored_in_photo=hidden))
            # Height, pitch and roll are held back by what the phone knows of them.
            held = ((np.asarray(poses) - start) / np.maximum(sigmas, 1e-6)) ** 2
            return scores - held.sum(axis=1) / (2 * SHARPNESS), scores

        steps, halvings = FIRST_STEPS, 0
        (best,), (score,) = worth([pose])
        for _ in range(60):
            tried = pose + steps * DIRECTIONS
            values, scores = worth(tried)
            top = values.argmax()
            if values[top] > best:
                best, score, pose = values[top], scores[top], tried[top]
            elif halvings == HALVINGS:
                break
            else:
                steps, halvings = steps / 2, halvings + 1
        return float(score), pose

    def covariance(self, pose, score, host, hidden, stride):
        """Second moments of the likelihood over 2 m and 2° around the pose; at least 0.1 m and 0.1°."""
        aside_m, turns_rad = np.linspace(-2, 2, 7), np.radians(np.linspace(-2, 2, 5))
        offsets = np.array([(east, north, 0, yaw, 0, 0) for east in aside_m for north in aside_m for yaw in turns_rad])
        scores = []
        for part in np.array_split(offsets, 10):
            host.check_cancelled()
            scores.append(shares(host.compare_views(pose + part, stride=stride, ignored_in_photo=hidden)))
        weights = likelihood(np.concatenate(scores), score)
        moments = np.cov(offsets[:, [0, 1, 3]].T, aweights=weights, ddof=0)
        return moments + np.diag([0.1, 0.1, np.radians(0.1)]) ** 2


def shares(counts):
    """Share of the compared pixels whose class is the same, from the counts of the host; 0 where nothing was compared."""
    compared = counts[..., 0].sum(axis=-1)
    return counts[..., 2].sum(axis=-1) / np.maximum(compared, 1)


def likelihood(score, best):
    return np.exp(np.minimum(0.0, SHARPNESS * (score - best)))


def apart(poses, scores, most=8):
    """The poses that score best and are more than 3 m or 6° from each other."""
    taken = []
    for index in np.argsort(-scores, kind="stable"):
        pose = poses[index]
        if all(np.hypot(*(pose - other)[:2]) > 3.0 or abs(pose[3] - other[3]) > np.radians(6) for other in taken):
            taken.append(pose)
        if len(taken) == most:
            break
    return taken


if __name__ == "__main__":
    main(MyMatcher)
