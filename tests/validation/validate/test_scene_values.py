"""The scenes' values on the page of validate."""

from validation.scenes.load import load_scene
from validation.validate.scene_values import KEY_AND_UNIT, scene_rows


def test_scene_rows_have_every_key_that_a_scene_states_or_takes_by_default() -> None:
    torques = "drive.torques={time=[0, 1], values=[[0, 0, 0], [1, 1, 2]]}"
    own = load_scene(
        "soft", [torques, "finger.length=[0.05, 0.04, 0.03]", "material.law=neo-hooke"]
    )
    given = scene_rows({"unit": load_scene("soft").tables, "own": own.tables})
    rows = {row.pop(KEY_AND_UNIT): row for row in given}
    assert rows["material.youngs_modulus (Pa)"] == {"unit": "1e+9", "own": "1e+9"}
    assert rows["material.law"] == {"unit": "saint-venant-kirchhoff", "own": "neo-hooke"}
    assert rows["finger.length (m)"] == {"unit": "0.04", "own": "0.05, 0.04, 0.03"}
    assert rows["drive.torques (N m)"] == {"unit": None, "own": "a table of 2 times"}
    assert rows["drive.reaction"] == {"unit": "false", "own": "false"}
    assert all(row["own"] is not None for row in rows.values())
    assert "tip.compliance_nn" not in rows  # in neither
    assert not any(key.startswith("solver") for key in rows)
