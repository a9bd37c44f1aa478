"""The time of one scan against 200 segments, and the time that it may take.

Run it with `python tests/benchmarks/laser_scan.py`.
"""

import time

import numpy as np

from course.world import Laser
from course.world.geometry import RayCaster, box, circle

LIMIT = 0.5e-3  # s


def main():
    random = np.random.default_rng(0)
    obstacles = [circle(*random.uniform(-4.0, 4.0, 2), 0.2, sides=14) for _ in range(14)]
    caster = RayCaster(np.concatenate([box(-5.0, -5.0, 5.0, 5.0), *obstacles]))
    laser, pose = Laser(), (0.0, 0.0, 0.3)
    times = []
    for _ in range(1020):
        start = time.perf_counter()
        laser.measure(caster, pose, random)
        times.append(time.perf_counter() - start)
    for share in (5, 50, 95):
        value = np.percentile(times[20:], share)
        print(f"p{share:<2} {value * 1e3:.3f} ms a scan of {laser.beams} beams, {value / LIMIT:.2f} of the limit")


if __name__ == "__main__":
    main()
