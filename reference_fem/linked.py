"""The compilers of kernels; those that only kernels call are compiled as parts of their callers.

As `hcm.linked`, which says why, and which this package can't import: the first tap compiles in 35 s
of processor instead of 52 (measured).
"""

from typing import Any

from numba import _dynfunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class _Library(JITCodeLibrary):
    """Code that its callers link."""

    def _optimize_final_module(self) -> None:
        """Leave it to the callers, which optimize all that they link."""

    def _finalize_final_module(self) -> None:
        """End as numba's does, without machine code."""
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    _name = "linked_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        of = state.cr.fndesc
        # by this object callers find the kernel; without an address it can't be called itself
        function = _dynfunc.make_function(
            of.lookup_module(), of.unique_name, "", 0, state.cr.env, (state.library,)
        )
        state.targetctx.insert_user_function(function, of, [state.library])
        state.cr = state.cr._replace(cfunc=function)
        return True


class OwnCompiler(Compiler):
    """numba's, with parts of its own of numba's functions.

    By itself numba keeps these parts by their types alone, with the fast-math flags of the first
    that needed them: bits of a result would depend on what a process has compiled before.
    """

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.state.targetctx.cached_internal_func = {}


class LinkedCompiler(OwnCompiler):
    """numba's passes, of which the last leaves optimization and machine code to the callers."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's one pipeline, as its manual has it."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (_Lowering if one is NativeLowering else one, what) for one, what in passes.passes
        ]
        passes.finalize()
        return [passes]
