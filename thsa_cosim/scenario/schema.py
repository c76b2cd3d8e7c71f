"""The tables of a scenario file: which keys there are, their types and ranges, and what they mean.

A further kind of scenario is one more class in ``KINDS``. After a change run ``python docs/generate.py``.
"""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from thsa_cosim.errors import did_you_mean
from thsa_cosim.laws import FORMS
from thsa_cosim.scenario.diagnose_schema import DiagnoseOptionsTable
from thsa_cosim.scenario.recording_schema import RecordingsTable, TemperatureTable
from thsa_cosim.scenario.system_schema import ModelTable
from thsa_cosim.scenario.table import (
    Name,
    NotNegative,
    Positive,
    Share,
    StartValue,
    Table,
    check_order,
    check_pairs,
)
from thsa_cosim.search.strategies import SearchMethod, Strategy


class LawTable(Table):
    """``[parameters.law]``: the form over temperature, and a published curve to compare with.

    A parameter without this table gets no law; ``law = {}`` gets one whose form is chosen.
    """

    form: str | None = None
    """constant, linear, quadratic, cubic, exponential, double-exponential, copper, vogel or spline; left out: chosen
    by corrected AIC, copper for resistances and vogel for friction among the candidates."""
    published: list[float] | None = None
    """Coefficients of a curve to compare with, from α0 up, or α1, β1, α2, β2."""
    published_form: str | None = None
    """Its form, if it is not ``form``."""
    quantity: (
        Literal["winding-resistance", "magnet-flux", "viscous-friction", "coulomb-friction", "none"] | None
    ) = None
    """The material whose behaviour over temperature the law is compared with; left out: as the unit suggests (ohm, Wb,
    N.m/(rad/s), N/(m/s), N, N.m). "none": no comparison."""

    @property
    def compared_form(self) -> str | None:
        """Form of the published curve."""
        return self.published_form or self.form

    @field_validator("form", "published_form")
    @classmethod
    def _form(cls, form: str | None) -> str | None:
        if form is not None and form not in FORMS:
            hint = did_you_mean(form, FORMS)
            raise PydanticCustomError(
                "form",
                "must be one of {forms}, not {form}.{hint}",
                {"forms": ", ".join(FORMS), "form": repr(form), "hint": hint},
            )
        return form

    @model_validator(mode="after")
    def _coefficients(self) -> "LawTable":
        form = self.compared_form
        if self.published is None:
            return self
        if form is None or form == "spline":
            raise PydanticCustomError("published", "published needs a form with coefficients; set form")
        if len(self.published) != FORMS[form]:
            raise PydanticCustomError(
                "published",
                "published holds {found} coefficients, but {form} has {wanted}",
                {"found": len(self.published), "form": form, "wanted": FORMS[form]},
            )
        return self


class ParameterTable(Table):
    """``[[parameters]]``: what is searched."""

    name: Name
    """Its name in results."""
    variable: Name
    """The FMU parameter that is varied."""
    unit: str
    """Unit of the bounds and of the result; converted to the FMU's."""
    lower: float
    """Lower bound."""
    upper: float
    """Upper bound."""
    scale: Literal["linear", "log"] = "linear"
    """``"log"`` for bounds that span decades."""
    start: float | None = None
    """Takes the place of one vector of the first population."""
    description: str = ""
    """For tables; left out: the FMU's."""
    per: Literal["point", "recording"] = "point"
    """``"recording"``: a separate value for each recording of a point, such as an offset."""
    zero: list[Name] = Field(default_factory=list)
    """FMU parameters (names or globs) that are 0 in every run."""
    law_block: Name | None = None
    """Zeroes all other parameters of that block: ``"motor.R_s"`` with the variable ``motor.R_s.a0`` leaves a0
    as the value itself."""
    law: LawTable | None = None


class ChannelTable(Table):
    """``[cost.channels.<variable>]``: the outputs that count; without any, every measured one does."""

    weight: Positive = 1.0
    """Factor on the channel's cost."""
    noise: float | str = "estimate"
    """Standard deviation of the sensor's noise in the FMU variable's unit, or ``"estimate"``: from the
    recording."""
    band: Positive | None = None
    """Hz: compare what is below it, after the same low-pass without phase shift on both sides. ``noise`` is then
    the noise in that band, as a number."""

    @model_validator(mode="after")
    def _noise_in_band(self) -> "ChannelTable":
        if self.band is not None and self.noise == "estimate":
            raise PydanticCustomError(
                "band", "band needs noise as a number: the standard deviation in that band"
            )
        return self

    @property
    def given_noise(self) -> float | None:
        """``noise`` as a number; None where it is to be estimated."""
        return None if isinstance(self.noise, str) else float(self.noise)

    @field_validator("noise")
    @classmethod
    def _noise(cls, noise: float | str) -> float | str:
        if noise == "estimate" or (isinstance(noise, float | int) and noise > 0):
            return noise
        hint = did_you_mean(noise, ["estimate"]) if isinstance(noise, str) else ""
        raise PydanticCustomError(
            "noise", "must be 'estimate' or a number above 0 in the variable's unit.{hint}", {"hint": hint}
        )


class WindowTable(Table):
    """``[cost.window]``: which samples count."""

    start: float | None = None
    """s after the first sample; earlier samples do not count."""
    stop: float | None = None
    """s after the first sample; later samples do not count."""

    @model_validator(mode="after")
    def _order(self) -> "WindowTable":
        check_order(self.start, self.stop)
        return self


ErrorName = Literal["squared", "absolute", "huber"]


class CostTable(Table):
    """``[cost]``: equation 6."""

    error: ErrorName = "squared"
    """f in equation 6."""
    also: list[ErrorName] = Field(default_factory=list)
    """Further f, evaluated at the estimate and reported in addition."""
    channels: dict[Name, ChannelTable] = Field(default_factory=dict)
    window: WindowTable = WindowTable()
    mask: list[list[float]] = Field(default_factory=list)
    """Pairs ``[from, to]`` in s after the first sample that do not count."""

    @field_validator("mask")
    @classmethod
    def _mask(cls, mask: list[list[float]]) -> list[list[float]]:
        return check_pairs(mask)


class EvolutionTable(Table):
    """``[search]``: differential evolution, the article's setting by default."""

    population: Annotated[int, Field(ge=5, le=100_000)] = 45
    """S, the vectors of a generation."""
    generations: Annotated[int, Field(ge=1, le=1_000_000)] = 30
    """G, at most."""
    mutation: Annotated[float, Field(gt=0, lt=2)] = 0.16
    """F."""
    crossover: Share = 0.5
    """CR."""
    strategy: Strategy = "rand1bin"
    """One of SciPy's strategies."""
    tolerance: NotNegative = 1e-3
    """Stop once all costs of the population lie within this share of the best; 0: never."""


class SearchTable(EvolutionTable):
    """``[search]``: local searches first, differential evolution where they do not agree on a minimum."""

    method: SearchMethod = "local-first"
    """``"local-first"``: least squares from spread starts; differential evolution only where they do not agree.
    ``"differential-evolution"``: that alone, the article's way."""
    polish: bool = True
    """Least squares from the best vector; standard errors need it. Without it the evolution runs alone."""
    profile: list[Name] = Field(default_factory=list)
    """Names of parameters whose profile likelihood is computed."""


class SimulationTable(Table):
    """``[simulation]``: how the FMU is run."""

    interface: Literal["co-simulation", "model-exchange"] | None = None
    """Left out: Co-Simulation if the FMU has it."""
    inputs: Literal["hold", "mean", "derivative", "intermediate"] | None = None
    """How inputs that run linearly reach a Co-Simulation FMU within a step: held at its begin or at its mean, by input
    derivatives (FMI 2.0), by intermediate update (FMI 3.0). Left out: the best one in a trial on the first recording,
    which may be Model Exchange if ``interface`` is left out too."""
    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Relative tolerance handed to the FMU (or to CVODE); left out: the FMU's own."""
    step: Positive | None = None
    """s between communication points; left out: the recording's samples."""
    stepping: Literal["free", "samples"] = "free"
    """An FMU that this package exported is given the whole run at once, so that its solver steps across samples;
    ``"samples"`` communicates at every one of them, as with other FMUs."""
    deadline: Positive = 60.0
    """s; a run that takes longer is killed and counts as failed."""
    memory: Positive | None = None
    """MB by which a worker may grow before its run is killed."""
    reuse: Literal["fresh", "reset"] = "fresh"
    """``"reset"`` keeps one FMU instance and resets it: only where ``thsa-cosim check`` found that right."""


class ForceTable(Table):
    """``[force]``: the force residual, an inverse-dynamics view beside the errors of the outputs.

    What the model's forces lack to explain the measured motion, below ``band``: F_m − F_s − M (a_m − a_s), with
    accelerations from the positions by zero-phase filters. The loops around the model do not blur it.
    """

    position: Name
    """A measured output: the position, or the angle."""
    force: Name
    """A measured output: the force, or the torque, of the drive."""
    mass: Name
    """The FMU parameter that is the mass, or the inertia, which it moves."""
    band: Positive = 20.0
    """Hz."""
    period: Positive | None = None
    """s after which the motion repeats; the difference between laps is printed with the residual."""


class CommonTable(ModelTable):
    """Keys of every kind that runs an FMU against recordings."""

    kind: str
    """What to do: the command of that name runs it."""
    title: str = ""
    """Shown in tables, plots and ``result.json``."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    """Of the search; the same seed repeats a study exactly. ``--seed`` replaces it."""
    recordings: RecordingsTable
    temperature: TemperatureTable | None = None
    parameter_set: Name | None = None
    """Path of an SSV file with start values, for example the ``identified.ssv`` of a study. Numbers, Booleans, texts
    (``String``) and items of enumerations by name are read; arrays and binaries are refused."""
    fixed: dict[Name, StartValue] = Field(default_factory=dict)
    """Start values held in every run, by FMU variable, in the FMU's units; they win over ``parameter_set``. A String
    variable, be it a parameter or an input, gets a text in quotes, or the path of a file as ``{ file = "table.txt" }``.
    An enumeration gets the number of its item.
    """
    cost: CostTable = CostTable()
    simulation: SimulationTable = SimulationTable()


class SimulateTable(CommonTable):
    """``kind = "simulate"``: run once per recording, compare."""

    outputs: list[Name] = Field(default_factory=list)
    """Outputs to record besides those with a column; none named: all."""


class IdentifyTable(CommonTable):
    """``kind = "identify"``: find parameters, per temperature or jointly."""

    parameters: list[ParameterTable] = Field(min_length=1)
    search: SearchTable = SearchTable()
    force: ForceTable | None = None


class DiagnoseParameterTable(ParameterTable):
    """``[[parameters]]`` of a diagnosis: a declared parameter, known from the drawing up to its spread."""

    spread: Positive | None = None
    """Relative standard deviation about the drawing's value."""


class DiagnoseTable(IdentifyTable):
    """``kind = "diagnose"``: find what the model lacks."""

    parameters: list[DiagnoseParameterTable] = Field(min_length=1)  # type: ignore[assignment]
    diagnose: DiagnoseOptionsTable = DiagnoseOptionsTable()


class StageTable(Table):
    """``[[stages]]``: what is run, in order."""

    scenario: Name
    """Path of the scenario."""
    give: list[Name] | None = None
    """Names of results that later stages get; left out: all."""


class StagesTable(Table):
    """``kind = "identify"`` in stages: scenarios in order, each with what the earlier ones found.

    A stage gets the values of its own temperatures, with their uncertainty.
    """

    kind: str
    """``"identify"``."""
    title: str = ""
    """Shown in tables and ``result.json``."""
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    """Replaces those of the stages."""
    stages: list[StageTable] = Field(min_length=1)


KINDS: dict[str, type[CommonTable]] = {
    "identify": IdentifyTable,
    "simulate": SimulateTable,
    "diagnose": DiagnoseTable,
}
"""Table class per ``kind``."""
