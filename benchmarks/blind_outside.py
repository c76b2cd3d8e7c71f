"""Effects that the catalogue of the contract does not have: a diagnosis should say so, and not name another."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from blind_effects import Draft, Random, log_uniform
from blind_plant import Rig


def presliding(random: Random, rig: Rig) -> Draft:
    """The nut's friction as bristles that bend before they slip (Canudas de Wit 1995)."""
    return Draft("presliding", "LuGre", lambda a: {"bristle": rig.F_fn / (5e-6 * a)}, 20.0)


def resolver_eccentricity(random: Random, rig: Rig) -> Draft:
    """A measured motor speed that swings once or twice a revolution, and a loop that follows it."""
    order = float(random.choice([1.0, 2.0]))
    return Draft(
        "resolver-eccentricity",
        f"{order:.0f} a revolution",
        lambda a: {"resolver": 0.01 * a, "resolver_order": order},
        10.0,
    )


def supply_limit(random: Random, rig: Rig) -> Draft:
    """A supply too weak for full speed: the voltage ends below what 9 mm/s asks for."""
    wanted = 1.5**0.5 * rig.p * rig.psi_pm * 9e-3 * rig.i / rig.k
    return Draft(
        "supply-limit", "constant", lambda a: {"supply_lost": rig.U_max - wanted * (1.05 - 0.05 * a)}, 10.0
    )


def command_delay(random: Random, rig: Rig) -> Draft:
    """The velocity command reaches the controller late."""
    return Draft("command-delay", "pure transport", lambda a: {"command_delay": 5e-3 * a}, 10.0)


def dwell_friction(random: Random, rig: Rig) -> Draft:
    """Breakaway that grows while the contact rests (Dieterich's age of the contact)."""
    time, slip = log_uniform(random, 0.1, 0.6), log_uniform(random, 1e-5, 1e-4)
    return Draft(
        "dwell-friction",
        "age of the contact",
        lambda a: {"dwell": rig.F_fn * a, "dwell_time": time, "dwell_slip": slip},
        3.0,
    )


def vibration(random: Random, rig: Rig) -> Draft:
    """A periodic force on the nut that the load cell does not see."""
    frequency = log_uniform(random, 3.0, 30.0)
    return Draft(
        "vibration",
        f"{frequency:.1f} Hz",
        lambda a: {"vibration": 1e3 * a, "vibration_frequency": frequency},
        20.0,
    )


def leaky_integrator(random: Random, rig: Rig) -> Draft:
    """The integrator of the velocity controller forgets."""
    return Draft("leaky-integrator", "first order", lambda a: {"leak": 0.02 * a}, 30.0)


def scale_error(random: Random, rig: Rig) -> Draft:
    """Interpolation error of the position scale, periodic in its pitch."""
    pitch = log_uniform(random, 5e-4, 2e-3)
    return Draft(
        "scale-error",
        f"pitch {pitch * 1e3:.2f} mm",
        lambda a: {"scale_error": 2e-6 * a, "scale_pitch": pitch},
        20.0,
    )


OUTSIDE: Mapping[str, Callable[[Random, Rig], Draft]] = {
    maker.__name__.replace("_", "-"): maker
    for maker in (
        presliding,
        resolver_eccentricity,
        supply_limit,
        command_delay,
        dwell_friction,
        vibration,
        leaky_integrator,
        scale_error,
    )
}
