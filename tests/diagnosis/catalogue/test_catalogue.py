"""The catalogue is complete, its units add up, and every candidate finds its slot."""

import re
from pathlib import Path

import pytest

from thsa_cosim.diagnosis import Effect, EffectParameter, known_effects
from thsa_cosim.diagnosis.catalogue.candidate import candidates_of
from thsa_cosim.diagnosis.catalogue.effect import powers
from thsa_cosim.diagnosis.catalogue.known import choose
from thsa_cosim.diagnosis.catalogue.slots import INPUTS, OUTPUTS, Slot, find_slots
from thsa_cosim.diagnosis.explaining.empirical import EMPIRICAL
from thsa_cosim.errors import ModelicaError, ScenarioError
from thsa_cosim.units import same_dimension

PACKAGE = Path(__file__).parents[3] / "modelica" / "THSA"
PROMISED = [
    "stribeck",
    "asymmetric-friction",
    "load-dependent-friction",
    "backlash",
    "cogging",
    "screw-ripple",
    "position-friction",
    "winding-self-heating",
    "torque-constant-saturation",
    "windage",
    "friction-run-in",
    "current-sensor-gain",
    "current-sensor-offset",
    "velocity-sensor-gain",
    "velocity-sensor-delay",
    "inverter-dead-time",
]
EFFECTS = known_effects()


@pytest.fixture(scope="module")
def slots() -> tuple[Slot, ...]:
    return find_slots("THSA.Actuator", PACKAGE)


def test_every_promised_effect_is_there():
    assert set(PROMISED) <= EFFECTS.keys()
    assert not {e.name for e in EMPIRICAL} & EFFECTS.keys(), "an empirical law is no effect with a name"


@pytest.mark.parametrize(
    "effect", [*EFFECTS.values(), *EMPIRICAL], ids=[*EFFECTS, *(e.name for e in EMPIRICAL)]
)
def test_an_effect_says_what_it_is_and_has_its_modelica_class(effect: Effect):
    for text in (effect.title, effect.physics, effect.source, effect.signature):
        assert len(text.split()) > 2
    for variant in effect.variants:
        source = (PACKAGE / "Effects" / f"{variant.block}.mo").read_text(encoding="utf-8")
        if other := re.search(
            r"extends THSA\.Effects\.(\w+);", source
        ):  # the same equations under another name
            source += (PACKAGE / "Effects" / f"{other[1]}.mo").read_text(encoding="utf-8")
        assert f"extends THSA.Interfaces.{variant.interface};" in source
        assert variant.block in (PACKAGE / "Effects" / "package.order").read_text(encoding="utf-8").split()
        declared = set(re.findall(r"^  parameter Real (\w+)", source, re.MULTILINE))
        assert {p.name for p in variant.parameters} <= declared
        assert any(p.role == "coefficient" for p in variant.parameters)
        for p in variant.parameters:
            assert p.lower <= p.neutral <= p.upper if p.role == "coefficient" else p.lower < p.upper
            assert p.typical != 0.0
            for start in p.starts:
                assert p.lower <= start <= p.upper, f"{p.name} starts outside its range"


def test_every_slot_has_candidates_with_names_and_variables_of_their_own(slots: tuple[Slot, ...]):
    assert {s.name for s in slots} == {
        "inverter", "winding", "torque", "motor", "gearbox", "shaft", "contact", "screw",
        "currentSensor", "velocitySensor"
    }  # fmt: skip
    made = candidates_of(EFFECTS.values(), slots, {})
    assert {c.slot.name for c in made} == {s.name for s in slots}
    assert len({c.key for c in made}) == len(made)
    assert {c.effect.name for c in made} >= set(PROMISED)
    named = {c.name for c in made}
    assert {"stribeck:screw", "stribeck:motor", "backlash", "current-sensor-offset"} <= named
    for effect in ("stribeck", "asymmetric-friction", "load-dependent-friction", "friction-run-in"):
        assert {f"{effect}:{place}" for place in ("motor", "gearbox", "screw")} <= named, "each of them rubs"
    for c in made:
        assert all(p.variable.startswith(f"{c.slot.component}.{c.component}.") for p in c.parameters)


def test_units_of_the_candidates_are_those_of_their_slots(slots: tuple[Slot, ...]):
    units = {p.variable: p.unit for c in candidates_of(EFFECTS.values(), slots, {}) for p in c.parameters}
    expected = {
        "motorEffect.stribeck.dF": "N.m",
        "screwEffect.stribeck.v_S": "m/s",
        "motorEffect.windage.b_q": "N.m.s2/rad2",
        "screwEffect.asymmetricFriction.db": "N.s/m",
        "screwEffect.positionFriction.c1": "N/m",
        "screwEffect.positionFriction.kappa": "rad/m",
        "motorEffect.cogging.n": "1",
        "screwEffect.loadDependentFriction.mu": "1",
        "contactEffect.backlash.gap": "m",
        "torqueEffect.torqueConstantSaturation.a": "1/A2",
        "inverterEffect.inverterDeadTime.U_d": "V",
        "currentSensorEffect.sensorOffset.o": "A",
        "velocitySensorEffect.sensorDelay.tau": "s",
        "windingEffect.windingSelfHeating.h": "K/J",
    }
    for variable, unit in expected.items():
        assert same_dimension(units[variable], unit), f"{variable}: {units[variable]} is not {unit}"


def test_scales_and_units_follow_the_dimension():
    assert powers("F/V^2") == [("F", 1), ("V", -2)]
    p = EffectParameter("c", "F*Z/V^2", 1.0, "")
    assert p.scale({"F": 6.0, "Z": 2.0, "V": 2.0}) == 3.0
    assert same_dimension(p.unit({"F": "N.m", "Z": "rad", "V": "rad/s"}), "N.m.s2/rad")
    assert EffectParameter("s", "s", 1.0, "").scale({"F": 9.0}) == 1.0
    assert EffectParameter("r", "1", 1.0, "").unit({"F": "N"}) == "1"
    assert EffectParameter("a", "1/I^2", 1.0, "").unit({"I": "A"}) == "1/A2"


def test_a_model_without_slots_and_an_unknown_effect_are_refused_in_one_sentence(tmp_path: Path):
    with pytest.raises(ModelicaError, match="has no effect slot"):
        find_slots("THSA.Benches.Motor", PACKAGE)
    with pytest.raises(ScenarioError, match=r"no effect 'stribek'.*Did you mean 'stribeck'"):
        choose(EFFECTS, ("stribek",), "x.toml: diagnose.effects")


def test_slots_are_inherited_less_those_that_are_taken(tmp_path: Path, slots: tuple[Slot, ...]):
    assert find_slots("THSA.ThermalActuator", PACKAGE) == slots
    own = tmp_path / "Motor2.mo"
    own.write_text(
        "model Motor2\n"
        "  extends THSA.Examples.BrushlessMotor(\n"
        "    // redeclare THSA.Effects.Stribeck torqueEffect,\n"
        "    redeclare THSA.Effects.Windage motorEffect(b_q=1e-7));\n"
        "end Motor2;\n",
        encoding="utf-8",
    )
    base = find_slots("THSA.Examples.BrushlessMotor", PACKAGE)
    assert find_slots(str(own), PACKAGE) == tuple(slot for slot in base if slot.name != "motor")


def test_a_place_that_there_is_several_times_takes_what_the_single_one_takes(slots: tuple[Slot, ...]):
    """Every slot of the single actuator but the shaft's is there for each lane or path, with the same effects."""
    single = {s.name: s for s in slots}
    redundant = find_slots("THSA.RedundantActuator", PACKAGE)
    made = candidates_of(EFFECTS.values(), redundant, {})
    for slot in redundant:
        (like,) = [name for name in single if slot.is_a(name)]
        assert (slot.interface, slot.units) == (single[like].interface, single[like].units)
        own = candidates_of(EFFECTS.values(), [single[like]], {})
        assert {c.effect.name for c in made if c.slot == slot} >= {
            c.effect.name for c in own if c.effect.part != "screw"
        }
    assert {s.name for s in redundant} >= {"motorA", "motorB", "contactPrimary", "contactSecondary"}
    names = {c.name for c in made}
    assert {"cogging:motorB", "backlash:contactSecondary", "current-sensor-gain:currentSensorA"} <= names
    assert "velocity-sensor-delay" in names  # there is one such place


def test_a_place_is_no_other_one_whose_name_begins_alike():
    slot = Slot("motorised", "FrictionEffect", {})
    assert not slot.is_a("motor")
    assert all(Slot(f"motor{end}", "FrictionEffect", {}).is_a("motor") for end in ("", "A", "Left", "2"))


def test_effects_of_ones_own_folder_come_beside_the_known_effects(tmp_path: Path):
    own = (Path(known_effects.__code__.co_filename).parent / "effects" / "windage.py").read_text(
        encoding="utf-8"
    )
    (tmp_path / "mine.py").write_text(own.replace('name="windage"', 'name="mine"'), encoding="utf-8")
    assert known_effects(tmp_path).keys() == EFFECTS.keys() | {"mine"}
    (tmp_path / "broken.py").write_text("EFFECT = 1", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"broken.py: holds no EFFECT"):
        known_effects(tmp_path)
    (tmp_path / "broken.py").write_text("1 +", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"broken.py: cannot be loaded \(SyntaxError"):
        known_effects(tmp_path)


def test_every_interface_has_readers_and_writers():
    for interface in INPUTS:
        source = (PACKAGE / "Interfaces" / f"{interface}.mo").read_text(encoding="utf-8")
        assert set(re.findall(r"RealInput (\w+)", source)) == set(INPUTS[interface])
        assert set(re.findall(r"RealOutput (\w+)", source)) == set(OUTPUTS[interface])
