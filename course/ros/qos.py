"""Quality of service by the names of the command line: presets, policies, and profiles that match publishers."""

from collections.abc import Iterable, Mapping
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


def make_profile(
    preset: str, policies: Mapping[str, str | None], depth: int | None = None, lease: float | None = None
) -> tuple[Any, bool]:
    """Return the rclpy QoSProfile that these short names describe, and whether any of them changes the preset.

    `policies` has a value, or None, for each of POLICIES; `lease` is the lease duration of the liveliness (s).
    """
    from rclpy import qos
    from rclpy.duration import Duration

    profile = qos.QoSPresetProfiles.get_from_short_key(preset)
    kinds = {
        "history": qos.QoSHistoryPolicy,
        "reliability": qos.QoSReliabilityPolicy,
        "durability": qos.QoSDurabilityPolicy,
        "liveliness": qos.QoSLivelinessPolicy,
    }
    for policy, short in policies.items():
        if short:
            setattr(profile, policy, kinds[policy].get_from_short_key(short))
    if lease and lease >= 0:
        profile.liveliness_lease_duration = Duration(seconds=lease)
    if depth and depth >= 0:
        profile.depth = depth
    elif profile.durability == qos.QoSDurabilityPolicy.TRANSIENT_LOCAL and profile.depth == 0:
        profile.depth = 1
    return profile, any(policies.values()) or depth is not None or lease is not None


def words(profile: Any) -> str:
    """Return the two policies of a QoSProfile that most often make endpoints incompatible."""
    return f"{profile.reliability.name.lower()} and {profile.durability.name.lower()}"


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
