"""Cross-validation of the reduced model (``hcm``) against the reference (``reference_fem``).

Scenes, comparison, tables, figures, renders, page and command line live here. Importing the
package loads none of them: each command imports what it needs.
"""

from pathlib import Path

DATA = Path(__file__).parent / "data"
"""What the package keeps: printed and published numbers, truths, outcomes of long runs."""
