"""Texts as start values: FMI variables of type String."""

from collections.abc import Mapping

from thsa_cosim.errors import ParameterError
from thsa_cosim.fmu.description import FmuDescription


def check_texts(texts: Mapping[str, str], description: FmuDescription) -> dict[int, str]:
    """Return ``texts`` by value reference; ParameterError or FmuError for a name that takes no text."""
    found = {}
    for name, text in texts.items():
        variable = description.variable(name)
        if variable.type != "String" or variable.is_array or variable.variability == "constant":
            what = "an array" if variable.is_array else f"a {variable.variability} {variable.type}"
            raise ParameterError(f"{description.path}: {name} is {what} and takes no text.")
        if "\0" in text:
            raise ParameterError(
                f"{description.path}: the text for {name} holds a null character; remove it."
            )
        found[variable.value_reference] = text
    return found
