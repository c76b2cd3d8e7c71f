"""A drive of one's own: a file beside the scenario, or a package, built from the blocks that are shipped."""

from pathlib import Path

import pytest

from thsa_cosim.diagnosis.catalogue.extend import extended_class, qualified, source_beside, write_extended
from thsa_cosim.diagnosis.catalogue.slots import find_slots
from thsa_cosim.errors import ModelicaError
from thsa_cosim.export.flatten import flatten, locate

PACKAGE = Path(__file__).parents[3] / "modelica" / "THSA"
DRIVE = """model MyDrive "A drive"
  THSA.Interfaces.RealInput u;
  Real w(start=0, fixed=true);
  replaceable THSA.Effects.NoFriction screwEffect(v(unit="rad/s"), z(unit="rad"), N(unit="N.m"), F(unit="N.m"))
    constrainedby THSA.Interfaces.FrictionEffect "Slot";
equation
  der(w) = u - w - screwEffect.F;
  screwEffect.v = w;
  screwEffect.s = 0;
  screwEffect.z = 0;
  screwEffect.N = u;
end MyDrive;
"""


def test_a_class_in_a_file_stands_in_the_file_of_the_extended_one(tmp_path: Path) -> None:
    file = tmp_path / "MyDrive.mo"
    file.write_text("// mine\nwithin ;\n" + DRIVE)
    assert qualified(str(file), PACKAGE) == "MyDrive"
    assert [slot.name for slot in find_slots(str(file), PACKAGE)] == ["screw"]
    source = extended_class("Wider", "MyDrive", (), beside=source_beside(str(file), PACKAGE))
    source = source.replace("extends MyDrive(\n    );", "extends MyDrive;")
    extended = write_extended(tmp_path / "elsewhere", "Wider", source)
    assert "w" in flatten(str(extended), PACKAGE).variables


def test_a_package_of_ones_own_finds_the_shipped_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MODELICAPATH", raising=False)
    package = tmp_path / "Drives"
    package.mkdir()
    (package / "package.mo").write_text('within ;\npackage Drives "Mine"\nend Drives;\n')
    (package / "MyDrive.mo").write_text("within Drives;\n" + DRIVE)
    assert locate("Drives.MyDrive", package)[1] == "Drives.MyDrive"
    assert "screwEffect.F" in flatten("Drives.MyDrive", package).variables
    with pytest.raises(ModelicaError, match=r'diagnose.model to "Drives.MyDrive"'):
        source_beside(str(package / "MyDrive.mo"), package)
