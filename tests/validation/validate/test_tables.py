from pathlib import Path

import numpy as np
import pytest

from tests.validation.commands import Make
from validation.harness.tables import table_of, write_table
from validation.validate.tables import (
    ACCURACY_COLUMNS,
    EFFICIENCY_COLUMNS,
    accuracy_rows,
    efficiency_rows,
)


def test_accuracy_rows_have_sources_and_do_not_use_the_paper(make_record: Make) -> None:
    reduced = make_record(variant="N=60", peak=60.0)
    references = [
        make_record(model="fem3d", variant="ls-dyna-like", peak=75.0),
        make_record(model="fem2d", variant="fast", peak=50.0),
    ]
    over = [references[0], make_record(model="fem3d", variant="fast", peak=80.0)]
    table = table_of(accuracy_rows(reduced, references, over), ACCURACY_COLUMNS)
    assert tuple(table.columns) == ACCURACY_COLUMNS
    assert (table.reduced_source == "self").all()
    assert (table.reference_source == "other model").all()
    peaks = table[table.quantity == "peak Fn"].set_index("reference_model")
    assert peaks.error_percent["fem3d ls-dyna-like"] == pytest.approx(-20)
    assert peaks.error_percent["fem2d fast"] == pytest.approx(20)
    assert peaks.reference_high["fem3d ls-dyna-like"] == 80
    assert np.isnan(peaks.reference_high["fem2d fast"])
    # Table 2 stands beside the reference that stands in for LS-DYNA, and nowhere else
    assert peaks.paper_reduced["fem3d ls-dyna-like"] == 64.435
    assert peaks.paper_reference["fem3d ls-dyna-like"] == 64.126
    assert peaks.paper_source["fem3d ls-dyna-like"] == "paper: Table 2 (T2.3 T2.7 T2.11)"
    assert np.isnan(peaks.paper_reduced["fem2d fast"])
    own = table_of(accuracy_rows(make_record(), references, over), ACCURACY_COLUMNS)
    assert own.paper_reduced.isna().all()  # by an accuracy, not on the paper's elements
    printed = table.paper_reduced.notna()
    assert (table.paper_source[printed].str.startswith("paper: ")).all()
    magnitude = table[table.quantity.str.startswith("Sprague-Geers magnitude of Fn")]
    assert magnitude.error_percent.iloc[0] == pytest.approx(-20, abs=0.01)


def test_efficiency_rows_have_sources(make_record: Make) -> None:
    solid = make_record(model="fem3d", variant="ls-dyna-like", scene="hard")
    runs = [make_record(variant="N=60"), solid]
    table = table_of(efficiency_rows(runs), EFFICIENCY_COLUMNS)
    assert list(table.source) == ["self", "other model"]
    assert list(table.paper_time_s) == [480, 21473]
    assert list(table.paper_memory_MB) == [582, 310.5]
    assert list(table.wall_time_s) == [0.25, 50]
    assert table.paper_source[1].startswith("paper: Table 3 (T3.3 T3.7)")


def test_an_errors_column_has_two_digits_and_its_csv_all(tmp_path: Path) -> None:
    row = {"peak": 64.4748, "peak_error": 0.066451, "error_percent": -37.318}
    markdown = write_table(tmp_path, "one", table_of([row]), "One")
    assert markdown.splitlines()[-1].split()[1::2] == ["64.47", "0.066", "-37.32"]
    assert "0.066451" in (tmp_path / "one.csv").read_text()


def test_a_caption_means_in_latex_what_it_says(tmp_path: Path) -> None:
    write_table(tmp_path, "one", table_of([{"a_b": 1.0}]), r"5 % of x_1 & {C:\d} #2 ~ $3^2")
    assert (
        r"\caption{5 \% of x\_1 \& \{C:\textbackslash{}d\} \#2 \textasciitilde{}"
        r" \$3\textasciicircum{}2}"
    ) in (tmp_path / "one.tex").read_text()
