"""SSP archives: written, read back, nested, and refused in one sentence."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmu_sources import build

from system.test_coupled import RING, TIME, VALUES, ring
from thsa_cosim.errors import FmuError
from thsa_cosim.fmu.description import DefaultExperiment
from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.system import SystemPlant, read_description
from thsa_cosim.system.assemble import Part, Wire, assemble, assembled
from thsa_cosim.system.description import SystemDescription
from thsa_cosim.system.structure import System
from thsa_cosim.system.write import write_ssp

FMUS = Path(__file__).parents[2] / "fmus"
HEAD = (
    '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"'
    ' xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"'
    ' xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"'
    ' xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" version="1.0" name="nested">'
)
CONNECTORS = (
    '<ssd:Connectors><ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector>'
    '<ssd:Connector name="y" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>'
)
INNER = (
    f'<ssd:System name="inner">{CONNECTORS}'
    '<ssd:ParameterBindings><ssd:ParameterBinding source="resources/slow.ssv">'
    '<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">'
    '<ssm:MappingEntry source="time constant" target="slow.tau">'
    '<ssc:LinearTransformation factor="0.001"/></ssm:MappingEntry>'
    "</ssm:ParameterMapping></ssd:ParameterMapping></ssd:ParameterBinding></ssd:ParameterBindings>"
    f'<ssd:Elements><ssd:Component name="slow" source="resources/lag.fmu">{CONNECTORS}'
    '<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p">'
    '<ssv:Parameters><ssv:Parameter name="k"><ssv:Real value="-2"/></ssv:Parameter></ssv:Parameters>'
    "</ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
    "</ssd:Component></ssd:Elements><ssd:Connections>"
    '<ssd:Connection startConnector="u" endElement="slow" endConnector="u"/>'
    '<ssd:Connection startElement="slow" startConnector="y" endConnector="y"/>'
    "</ssd:Connections></ssd:System>"
)
NESTED = (
    f'{HEAD}<ssd:System name="outer"><ssd:Connectors><ssd:Connector name="shown" kind="output"><ssc:Real/>'
    "</ssd:Connector></ssd:Connectors><ssd:Elements>"
    f'<ssd:Component name="fast" source="resources/lag.fmu">{CONNECTORS}</ssd:Component>'
    f"{INNER}</ssd:Elements><ssd:Connections>"
    '<ssd:Connection startElement="fast" startConnector="y" endElement="inner" endConnector="u"/>'
    '<ssd:Connection startElement="inner" startConnector="y" endElement="fast" endConnector="u">'
    '<ssc:LinearTransformation factor="1" offset="1"/></ssd:Connection>'
    '<ssd:Connection startElement="inner" startConnector="y" endConnector="shown"/>'
    "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
)
SSV = (
    '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="s">'
    '<ssv:Parameters><ssv:Parameter name="time constant"><ssv:Real value="200"/></ssv:Parameter></ssv:Parameters>'
    "</ssv:ParameterSet>"
)


def archive(path: Path, structure: str = NESTED, **members: str) -> Path:
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("SystemStructure.ssd", structure)
        file.write(build.lag2(), "resources/lag.fmu")
        file.writestr("resources/slow.ssv", SSV)
        for name, text in members.items():
            file.writestr(name.replace("__", "/"), text)
    return path


def simulated(
    path: Path,
    output: str,
    values: dict[str, float],
    time: FloatArray = TIME,
    rates: dict[str, float] | None = None,
) -> FloatArray:
    """One output over ``time``; ``rates``: slopes of inputs that rise from zero."""
    inputs = (
        Signals(time, {n: r * time for n, r in rates.items()}, dict.fromkeys(rates, "1")) if rates else None
    )
    with SystemPlant.open(path) as plant:
        return plant.run(values, inputs, [output], time, tolerance=1e-9)[output]


def test_a_nested_system_with_bindings_mapping_and_transformation_is_the_flat_one(tmp_path: Path) -> None:
    found = simulated(archive(tmp_path / "nested.ssp"), "shown", {"fast.tau": VALUES["fast.tau"]})
    assert np.max(np.abs(found - ring(TIME)[:, 1])) < 1e-7


def test_the_types_of_ssp_2_are_read(tmp_path: Path) -> None:
    structure = NESTED.replace('version="1.0" name="nested"', 'version="2.0" name="nested"')
    structure = structure.replace("<ssc:Real/>", "<ssc:Float64/>").replace("<ssv:Real", "<ssv:Float64")
    found = simulated(archive(tmp_path / "two.ssp", structure), "shown", {"fast.tau": VALUES["fast.tau"]})
    assert np.max(np.abs(found - ring(TIME)[:, 1])) < 1e-7


def test_the_archive_says_which_interface_of_an_fmu_runs(tmp_path: Path) -> None:
    structure = NESTED.replace('name="fast"', 'name="fast" implementation="CoSimulation"')
    structure = structure.replace('name="slow" s', 'name="slow" implementation="ModelExchange" s')
    system = read_description(archive(tmp_path / "asked.ssp", structure)).system  # type: ignore[attr-defined]
    assert {c.name: c.execution for c in system.components} == {"fast": "coupled", "inner.slow": "continuous"}


def test_a_written_system_is_read_back_and_written_the_same(tmp_path: Path) -> None:
    slow = Part("slow", build.lag3(), "sampled", 0.01, 0.005, {"k": 3.0}, jitter=0.001)
    wires = [RING[0], replace(RING[1], disturbance="d")]
    system, archives = assemble("ring", [Part("fast", build.lag2()), slow], wires, {"y": ["slow.y"]})
    path = write_ssp(system, archives, tmp_path / "a.ssp", DefaultExperiment(0.0, 2.0))
    description = read_description(path)
    again = description.system  # type: ignore[attr-defined]
    assert [(c.name, c.execution, c.step, c.delay, c.jitter, dict(c.start)) for c in again.components] == [
        ("fast", "continuous", None, 0.0, 0.0, {}),
        ("slow", "sampled", 0.01, 0.005, 0.001, {"k": 3.0}),
    ]
    assert [c.disturbance for c in again.connections] == ["", "d"]
    assert set(again.connections) == set(system.connections)
    assert again.connectors == system.connectors
    assert description.default_experiment == DefaultExperiment(0.0, 2.0)
    twin = write_ssp(again, archives, tmp_path / "b.ssp", description.default_experiment)
    assert twin.read_bytes() == path.read_bytes()


def test_what_is_said_of_a_system_as_it_is_written_is_what_its_archive_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    slow = Part("slow", build.lag3(), "sampled", 0.01, 0.005, {"k": 3.0})
    wires = [RING[0], replace(RING[1], disturbance="d")]
    described = assembled("ring", [Part("fast", build.lag2()), slow], wires, {"y": ["slow.y"]})
    again = read_description(described.path)
    assert described.path.parent.parent == tmp_path / "thsa-cosim" / "systems"
    for own in (
        "sha256",
        "variables",
        "pins",
        "default_experiment",
        "capabilities",
        "states",
        "tool",
        "model_name",
    ):
        assert getattr(again, own) == getattr(described, own), own


def test_fmpy_reads_and_runs_what_we_write(tmp_path: Path) -> None:
    from fmpy.ssp.simulation import simulate_ssp

    plant, controller = Part("plant", FMUS / "Plant.fmu"), Part("controller", FMUS / "Controller.fmu")
    wires = [Wire("controller.i_ref", "plant.i_ref"), Wire("plant.w_m", "controller.w_m")]
    # fmpy sets an input that nothing drives to 0, not to its start value: every input is driven.
    inputs = {"v_cmd": ["controller.v_cmd"], "F_load": ["plant.F_load"], "T_amb": ["plant.T_amb"]}
    system, archives = assemble("THSA", [controller, plant], wires, {**inputs, "v": ["plant.v"]})
    path = write_ssp(system, archives, tmp_path / "thsa.ssp", DefaultExperiment(0.0, 0.2))
    step = 5e-4
    with np.errstate(all="ignore"):
        found = simulate_ssp(
            str(path),
            stop_time=0.2,
            step_size=step,
            input={"v_cmd": lambda time: 0.03 * time, "F_load": lambda _: 0.0, "T_amb": lambda _: 25.0},
        )
    ours = simulated(path, "v", {}, np.arange(0.0, 0.2, step), {"v_cmd": 0.03})
    theirs = np.interp(np.arange(0.0, 0.2, step), found["time"] + step, found["plant.v"])
    assert np.max(np.abs(theirs - ours)) < 0.03 * np.max(np.abs(ours))


def described(path: Path) -> System:
    description = read_description(path)
    assert isinstance(description, SystemDescription)
    return description.system


def wired(path: Path) -> tuple[object, ...]:
    system = described(path)
    starts = {c.name: dict(c.start) for c in system.components}
    return starts, set(system.connections), set(system.connectors)


def test_start_and_end_of_a_connection_say_nothing_of_its_direction(tmp_path: Path) -> None:
    """SSP 1.0, 5.3.3.1: the connectors' kinds do; editors write a connection as it was drawn."""
    turned = NESTED
    for one, other in (
        ('startElement="fast" startConnector="y"', 'endElement="inner" endConnector="u"'),
        ('startElement="slow" startConnector="y"', 'endConnector="y"'),
        ('startConnector="u"', 'endElement="slow" endConnector="u"'),
        ('startElement="inner" startConnector="y"', 'endConnector="shown"'),
    ):
        swapped = f"{other} {one}".replace("start", "START").replace("end", "start").replace("START", "end")
        assert f"<ssd:Connection {one} {other}/>" in turned
        turned = turned.replace(f"<ssd:Connection {one} {other}/>", f"<ssd:Connection {swapped}/>")
    assert wired(archive(tmp_path / "turned.ssp", turned)) == wired(archive(tmp_path / "n.ssp"))


def test_a_value_that_fits_nothing_is_ignored_and_said(tmp_path: Path) -> None:
    """SSP 1.0, 5.3.2: a set may hold values for other systems, texts among them."""
    more = NESTED.replace(
        "</ssv:Parameters>",
        '<ssv:Parameter name="kk"><ssv:Real value="1" unit="[strange]"/></ssv:Parameter>'
        '<ssv:Parameter name="colour"><ssv:String value="red"/></ssv:Parameter></ssv:Parameters>',
    )
    path = archive(tmp_path / "more.ssp", more)
    assert wired(path) == wired(archive(tmp_path / "nested.ssp"))
    system = described(path)
    assert len(system.notes) == 2
    assert "nothing is named 'inner.slow.kk', so it is ignored. Did you mean 'k'?" in system.notes[0]


def test_parameters_and_start_values_come_through_the_connectors_of_systems(tmp_path: Path) -> None:
    """What the outer system sets wins over what the inner one sets, and the connector is a parameter of the whole."""
    gain = '<ssd:Connector name="gain" kind="parameter"><ssc:Real/></ssd:Connector></ssd:Connectors>'
    structure = NESTED.replace("</ssd:Connectors>", gain, 1)
    inner = structure.index('<ssd:System name="inner">')
    inside = structure[inner:].replace("</ssd:Connectors>", gain, 1)
    inside = inside.replace(
        "</ssd:Connections>",
        '<ssd:Connection startConnector="gain" endElement="slow" endConnector="k"/></ssd:Connections>',
        1,
    )
    inside = inside.replace(
        "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>",
        '<ssd:Connection startConnector="gain" endElement="inner" endConnector="gain">'
        '<ssc:LinearTransformation factor="2" offset="-1"/></ssd:Connection>'
        "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>",
    )
    values = (
        "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>"
        '<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{}</ssv:Parameters></ssv:ParameterSet>'
        "</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings><ssd:Elements>"
    )
    given = '<ssv:Parameter name="{}"><ssv:Real value="{}"/></ssv:Parameter>'
    inner_only = values.format(given.format("inner.gain", 7.0))
    both = values.format(given.format("gain", -0.5) + given.format("inner.gain", 7.0))
    outer = structure[:inner]
    weak = described(archive(tmp_path / "weak.ssp", outer.replace("<ssd:Elements>", inner_only, 1) + inside))
    assert weak.component("inner.slow").start["k"] == 7.0
    path = archive(tmp_path / "strong.ssp", outer.replace("<ssd:Elements>", both, 1) + inside)
    assert described(path).component("inner.slow").start["k"] == -2.0
    gain_of_all = read_description(path).variables["gain"]
    assert (gain_of_all.causality, gain_of_all.start) == ("parameter", -0.5)
    plain = simulated(path, "shown", {"fast.tau": VALUES["fast.tau"]})
    assert np.max(np.abs(plain - ring(TIME)[:, 1])) < 1e-7
    halved = simulated(path, "shown", {"fast.tau": VALUES["fast.tau"], "gain": 0.0})  # k = -1
    direct = simulated(path, "shown", {"fast.tau": VALUES["fast.tau"], "inner.slow.k": -1.0})
    assert np.array_equal(halved, direct)
    assert np.max(np.abs(halved - plain)) > 0.1


def test_a_nested_system_whose_connector_is_left_open_keeps_its_start_value(tmp_path: Path) -> None:
    cut = NESTED.replace(
        '<ssd:Connection startElement="fast" startConnector="y" endElement="inner" endConnector="u"/>', ""
    )
    description = read_description(archive(tmp_path / "open.ssp", cut))
    assert description.variables["inner.u"].causality == "input"
    assert description.variables["inner.slow.u"].causality == "local"


DICTIONARY = (
    '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="resources/bus.ssb"/>'
    "</ssd:SignalDictionaries>"
)
SSB = (
    '<ssb:SignalDictionary xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary" version="1.0"'
    ' xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"><ssb:DictionaryEntry name="speed"><ssc:Real/>'
    "</ssb:DictionaryEntry></ssb:SignalDictionary>"
)


def test_signals_of_a_dictionary_connect_what_refers_to_it(tmp_path: Path) -> None:
    """``fast.y`` is written into the bus outside, and read from it inside the nested system."""
    reference = '<ssd:SignalDictionaryReference name="{}" dictionary="bus"/></ssd:Elements>'
    structure = NESTED.replace("<ssd:Elements>", DICTIONARY + "<ssd:Elements>", 1)
    structure = structure.replace("</ssd:Elements>", reference.format("inside"), 1)
    parts = structure.rsplit("</ssd:Elements>", 1)
    structure = reference.format("outside").join(parts)
    structure = structure.replace(
        '<ssd:Connection startConnector="u" endElement="slow" endConnector="u"/>',
        '<ssd:Connection startElement="inside" startConnector="speed" endElement="slow" endConnector="u"/>',
    ).replace('endElement="inner" endConnector="u"', 'endElement="outside" endConnector="speed"')
    path = archive(tmp_path / "bus.ssp", structure, **{"resources__bus.ssb": SSB})
    found = simulated(path, "shown", {"fast.tau": VALUES["fast.tau"]})
    assert np.max(np.abs(found - ring(TIME)[:, 1])) < 1e-7
    lost = archive(tmp_path / "lost.ssp", structure, **{"resources__bus.ssb": SSB.replace("speed", "sped")})
    with pytest.raises(FmuError, match=r"the signal dictionary 'bus' has no 'speed'\. Did you mean 'sped'\?"):
        read_description(lost)


def test_units_convert_before_the_transformation_by_the_definitions_of_the_file(tmp_path: Path) -> None:
    """SSP 1.0, 4.5.1: target = factor * (source in the target's unit) + offset."""
    units = (
        '<ssd:Units><ssc:Unit name="Schritt"><ssc:BaseUnit m="1" s="-1" factor="0.75"/></ssc:Unit>'
        '<ssc:Unit name="Elle"><ssc:BaseUnit m="1" s="-1" factor="0.5"/></ssc:Unit></ssd:Units>'
        "</ssd:SystemStructureDescription>"
    )
    structure = NESTED.replace(
        '<ssd:Connector name="u" kind="input"><ssc:Real/>',
        '<ssd:Connector name="u" kind="input"><ssc:Real unit="Schritt"/>',
    )
    structure = structure.replace(
        '<ssd:Connector name="shown" kind="output"><ssc:Real/></ssd:Connector>',
        '<ssd:Connector name="way" kind="input"><ssc:Real unit="Elle"/></ssd:Connector>',
    )
    structure = structure.replace(
        '<ssd:Connection startElement="fast" startConnector="y" endElement="inner" endConnector="u"/>',
        '<ssd:Connection startConnector="way" endElement="inner" endConnector="u">'
        '<ssc:LinearTransformation factor="3" offset="0.5"/></ssd:Connection>',
    ).replace('<ssd:Connection startElement="inner" startConnector="y" endConnector="shown"/>', "")
    path = archive(tmp_path / "units.ssp", structure.replace("</ssd:SystemStructureDescription>", units))
    (way,) = described(path).connectors
    (((component, variable), factor, offset),) = way.pins
    assert (component, variable) == ("inner.slow", "u")
    assert factor == pytest.approx(3 * 0.5)  # on to m/s by way of Schritt
    assert offset == pytest.approx(0.5 * 0.75)  # 0.5 Schritt


SECOND_WRITER = '<ssd:Connection startElement="fast" startConnector="y" endElement="fast" endConnector="u"/>'
END = "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
WRONG = [
    ("resources/lag.fmu", "resources/other.fmu", "holds no resources/other.fmu, which a component names"),
    ('endElement="inner"', 'endElement="iner"', "there is no element 'iner'. Did you mean 'inner'?"),
    (
        'startElement="fast" startConnector="y"',
        'startElement="fast" startConnector="yy"',
        "has no variable 'yy'",
    ),
    (END, SECOND_WRITER + END, "fast.u has two writers"),
    ('source="resources/slow.ssv"', 'source="resources/none.ssv"', "holds no resources/none.ssv"),
    ('source="time constant"', 'source="tau"', "a parameter mapping names 'tau', which its values lack"),
    ('factor="1"', 'factor="one"', "a factor is 'one', which is no number"),
    (
        'target="slow.tau"',
        'target="slow.taw"',
        "sets 'inner.slow.taw', but there is no such variable. Did you mean",
    ),
    (
        '<ssv:Real value="-2"/>',
        '<ssv:String value="-2"/>',
        "'k' holds String; only numbers can be set, so leave it out",
    ),
    ('endElement="inner" endConnector="u"', 'endElement="inner" endConnector="y"', "joins two that send"),
    ("</ssd:SystemStructureDescription>", "", "is no valid XML"),
    ('name="fast"', 'name="fast" implementation="ScheduledExecution"', "asks for 'ScheduledExecution'"),
    (
        "<ssc:Real/></ssd:Connector></ssd:Connectors><ssd:Elements>",
        '<ssc:Real/><ssc:Dimension size="3"/></ssd:Connector></ssd:Connectors><ssd:Elements>',
        "connector 'shown' is an array",
    ),
    ('Connection startConnector="u"', 'Connection startConnector="w"', "there is no connector 'w'"),
]


@pytest.mark.parametrize(("right", "wrong", "sentence"), WRONG, ids=[w[2][:30] for w in WRONG])
def test_what_is_wrong_with_an_archive_is_one_sentence(
    tmp_path: Path, right: str, wrong: str, sentence: str
) -> None:
    assert right in NESTED
    path = archive(tmp_path / "wrong.ssp", NESTED.replace(right, wrong))
    with pytest.raises(FmuError) as caught:
        read_description(path)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_system_that_contains_itself_is_refused(tmp_path: Path) -> None:
    structure = NESTED.replace("resources/lag.fmu", "inner.ssd", 1)
    path = archive(tmp_path / "cycle.ssp", structure, **{"inner.ssd": structure})
    with pytest.raises(FmuError, match=r"inner\.ssd contains itself"):
        read_description(path)


@pytest.mark.parametrize(
    ("parts", "wires", "connectors", "sentence"),
    [
        ([("a", {})], [("a.y", "b.u")], {}, "'b.u' names no component of the system"),
        ([("a", {})], [("a.u", "a.u")], {}, "its source is an input variable"),
        ([("a", {})], [("a.y", "a.tau")], {}, "a.tau is no input"),
        ([("a", {}), ("b", {})], [("a.y", "b.u"), ("a.feed", "b.u")], {}, "b.u has two writers"),
        ([("a", {}), ("b", {})], [("a.y", "b.u")], {"x": ["b.u"]}, "b.u has two writers"),
        ([("a", {"execution": "sampled"})], [], {}, "give it a positive step"),
        ([("a", {"execution": "sampled", "step": 0.1, "delay": 0.2})], [], {}, "exceeds its step"),
        ([("a", {"start": {"taw": 1.0}})], [], {}, "has no variable 'taw'"),
        ([("a", {})], [], {"out": ["a.y", "a.feed"]}, "has 2 sources"),
    ],
)
def test_what_is_wrong_with_a_system_is_one_sentence(parts, wires, connectors, sentence) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(FmuError) as caught:
        assemble("s", [Part(n, build.lag2(), **o) for n, o in parts], [Wire(*w) for w in wires], connectors)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_units_that_do_not_convert_are_refused() -> None:
    with pytest.raises(FmuError, match=r"connection a\.steps -> |connection a\.tau"):
        assemble("s", [Part("a", build.lag2()), Part("b", build.lag2())], [Wire("a.tau", "b.u")], {})


def test_clocks_that_an_importer_has_to_tick_are_refused() -> None:
    with pytest.raises(FmuError, match=r"component 'a': .* has clocks that the importer has to tick"):
        assemble("s", [Part("a", build.clock3())], [], {})


def test_an_item_of_an_enumeration_is_set_by_its_name_or_number(tmp_path: Path) -> None:
    """The FMU of strict2.c: its parameter ``order`` is an enumeration of one, two, three."""
    plain = '<ssd:ParameterBindings><ssd:ParameterBinding prefix="a."><ssd:ParameterValues>{}</ssd:ParameterValues>'
    values = (
        '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0"'
        ' name="s"><ssv:Parameters><ssv:Parameter name="order"><ssv:Enumeration value="{}"/></ssv:Parameter>'
        "</ssv:Parameters></ssv:ParameterSet>"
    )
    head = (
        '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"'
        ' version="1.0" name="s"><ssd:System name="s">'
    )
    parts = '<ssd:Elements><ssd:Component name="a" source="a.fmu"/></ssd:Elements>'
    tail = "</ssd:ParameterBinding></ssd:ParameterBindings>{}</ssd:System></ssd:SystemStructureDescription>"

    def system(item: str) -> System:
        path = tmp_path / "s.ssp"
        with zipfile.ZipFile(path, "w") as file:
            text = head + plain.format(values.format(item)) + tail.format(parts)
            file.writestr("SystemStructure.ssd", text)
            file.write(build.strict2(), "a.fmu")
        return described(path)

    for item in ("three", "3"):
        (component,) = system(item).components
        assert component.start == {"order": 3.0}
    with pytest.raises(FmuError, match=r"'a\.order' holds Enumeration; .* give one of one, two, three\."):
        system("four")
    with pytest.raises(FmuError, match=r"'a\.order' holds Enumeration; .* give one of one, two, three\."):
        system("4")
