"""The time of `autograder check` for the calculator's solution, its interface built: python check_reference.py"""

import statistics
import subprocess
import sys
import time
from pathlib import Path

AUTOGRADER = Path(sys.executable).with_name("autograder")
SOLUTION = Path(__file__).parents[2] / "solutions/calculator"
RUNS = 5


def check() -> float:
    start = time.perf_counter()
    subprocess.run([AUTOGRADER, "check", SOLUTION, "--assignment", "calculator"], check=True, capture_output=True)
    return time.perf_counter() - start


def main() -> None:
    check()  # builds the interface
    seconds = [check() for _ in range(RUNS)]
    print(
        f"autograder check of the reference: {statistics.median(seconds):.2f} s, the median of {RUNS} runs "
        f"({min(seconds):.2f} to {max(seconds):.2f} s)"
    )


if __name__ == "__main__":
    main()
