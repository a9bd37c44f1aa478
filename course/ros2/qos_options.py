"""Quality of service on the command line: the `--qos-...` options of `ros2 topic echo` and `pub`."""

from argparse import ArgumentParser, Namespace
from typing import Any

from course.ros.qos import POLICIES, PROFILES, make_profile


def add_arguments(parser: ArgumentParser, purpose: str, default: str) -> None:
    """Add `--qos-...`, for a publisher or a subscription."""
    compatible = "default: Compatible profile with running endpoints )"
    notes = {
        "history": "(overrides history value of --qos-profile option, default: keep_last)",
        "reliability": f"(overrides reliability value of --qos-profile option, {compatible}",
        "durability": f"(overrides durability value of --qos-profile option, {compatible}",
        "liveliness": "(overrides liveliness value of --qos-profile option)",
    }
    parser.add_argument(
        "--qos-profile",
        choices=PROFILES,
        default=default,
        help=f"Quality of service preset profile to {purpose} with (default: {default})",
    )
    parser.add_argument(
        "--qos-depth",
        metavar="N",
        type=int,
        help=f"Queue size setting to {purpose} with (overrides depth value of --qos-profile option)",
    )
    for policy, choices in POLICIES.items():
        what = "History of samples" if policy == "history" else f"Quality of service {policy}"
        parser.add_argument(
            f"--qos-{policy}", choices=choices, help=f"{what} setting to {purpose} with {notes[policy]}"
        )
    parser.add_argument(
        "--qos-liveliness-lease-duration-seconds",
        type=float,
        help=f"Quality of service liveliness lease duration setting to {purpose} with "
        "(overrides liveliness lease duration value of --qos-profile option)",
    )


def chosen_profile(args: Namespace) -> tuple[Any, bool]:
    """Return the rclpy QoSProfile that the options describe, and whether any of them changes the preset."""
    policies = {policy: getattr(args, f"qos_{policy}") for policy in POLICIES}
    return make_profile(args.qos_profile, policies, args.qos_depth, args.qos_liveliness_lease_duration_seconds)
