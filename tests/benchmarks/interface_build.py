"""The time to build Calculate.srv the first time, and again from the cache: python interface_build.py"""

import tempfile
import time
from pathlib import Path

from course.interfaces import build

CALCULATE = Path(__file__).parents[2] / "solutions/calculator/Calculate.srv"


def main() -> None:
    with tempfile.TemporaryDirectory() as cache:
        seconds = []
        for _ in range(2):
            start = time.perf_counter()
            build("calculator_interfaces", [CALCULATE], cache=Path(cache), use=False)
            seconds.append(time.perf_counter() - start)
    print(f"Calculate.srv: cold {seconds[0]:.2f} s, cached {seconds[1]:.3f} s, ratio {seconds[0] / seconds[1]:.0f}")


if __name__ == "__main__":
    main()
