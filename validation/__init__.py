"""Cross-validation of the reduced model (``hcm``) against the reference (``reference_fem``).

Scenes, comparison, tables, figures, renders, page and command line live here. Importing the
package loads none of them: each command imports what it needs.
"""
