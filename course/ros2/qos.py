"""Quality of service on the command line: the `--qos-...` options of `ros2 topic echo` and `pub`."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from typing import Any

# The short names of rclpy.qos, written out so that `-h` and completion need no rclpy.
PROFILES = (
    "unknown", "default", "system_default", "sensor_data", "services_default", "parameters", "parameter_events",
    "action_status_default", "best_available",
)  # fmt: skip
POLICIES = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": ("system_default", "automatic", "manual_by_topic", "unknown", "best_available"),
}


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


def make_profile(args: Namespace) -> tuple[Any, bool]:
    """Return the rclpy QoSProfile that the options describe, and whether any of them changes the preset."""
    from rclpy import qos
    from rclpy.duration import Duration

    profile = qos.QoSPresetProfiles.get_from_short_key(args.qos_profile)
    kinds = {
        "history": qos.QoSHistoryPolicy,
        "reliability": qos.QoSReliabilityPolicy,
        "durability": qos.QoSDurabilityPolicy,
        "liveliness": qos.QoSLivelinessPolicy,
    }
    chosen = {policy: getattr(args, f"qos_{policy}") for policy in kinds}
    for policy, short in chosen.items():
        if short:
            setattr(profile, policy, kinds[policy].get_from_short_key(short))
    lease = args.qos_liveliness_lease_duration_seconds
    if lease and lease >= 0:
        profile.liveliness_lease_duration = Duration(seconds=lease)
    if args.qos_depth and args.qos_depth >= 0:
        profile.depth = args.qos_depth
    elif profile.durability == qos.QoSDurabilityPolicy.TRANSIENT_LOCAL and profile.depth == 0:
        profile.depth = 1
    return profile, any(chosen.values()) or args.qos_depth is not None or lease is not None


def match_publishers(profile: Any, publishers: Iterable[Any]) -> None:
    """Set reliability and durability of a QoSProfile so that it is compatible with all publishers.

    `publishers` are their endpoints, as rclpy's TopicEndpointInfo.
    """
    from rclpy import qos

    for policy, kind, strict, loose in (
        ("reliability", qos.QoSReliabilityPolicy, "RELIABLE", "BEST_EFFORT"),
        ("durability", qos.QoSDurabilityPolicy, "TRANSIENT_LOCAL", "VOLATILE"),
    ):
        offered = [getattr(info.qos_profile, policy) == kind[strict] for info in publishers]
        if any(offered) and not all(offered):
            print(
                f"Some, but not all, publishers are offering {kind.__name__}.{strict}. "
                f"Falling back to {kind.__name__}.{loose} as it will connect to all publishers"
            )
        setattr(profile, policy, kind[strict] if all(offered) else kind[loose])
