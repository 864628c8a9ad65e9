"""Functions that the compiler chooses by the type of an argument."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numba

from engine_dyn.compilation.decorators import OPTIONS

__all__ = ["by_type"]


def _compiled(function: Callable[..., Any]) -> Any:

    return numba.njit(forceinline=True, **OPTIONS)(function)


def by_type(function: Callable[..., Any]) -> Any:
    """Make a function that the compiler chooses by the type of the last argument.

    The function itself is the general case. What is done instead for a class of named tuples is
    registered with ``@function.of(Class)``. The choice costs nothing at run time, because types are
    known when a kernel is compiled.

    Examples
    --------
    ::

        @by_type
        def load_terms(q: float, law: Any) -> float:
            return general(q, law)

        @load_terms.of(Power)
        def _terms_of_power(q: float, law: Power) -> float:
            return q**law.half
    """
    general = _compiled(function)
    special: dict[Any, Any] = {}

    def of(kind: type) -> Callable[[Callable[..., Any]], Any]:
        def register(implementation: Callable[..., Any]) -> Any:
            special[kind] = _compiled(implementation)
            return special[kind]

        return register

    if not hasattr(general, "get_call_template"):  # the compiler is off

        @functools.wraps(function)
        def call(*given: Any) -> Any:
            return special.get(type(given[-1]), function)(*given)

        call.of = of  # type: ignore[attr-defined]  # functions may have attributes
        return call

    template, overload = general.get_call_template, general.get_overload
    compile_for_python = general._compile_for_args

    def chosen(kind: Any) -> Any:
        return special.get(getattr(kind, "instance_class", None))

    # An overload in Numba's sense would be optimised apart from its caller, and round otherwise; so
    # the dispatcher of the general case hands calls over. Attributes of this one dispatcher; its
    # class stays as it is.
    def template_of(arguments: Any, named: dict[str, Any]) -> Any:
        other = chosen(arguments[-1])
        return (template if other is None else other.get_call_template)(arguments, named)

    def overload_of(kinds: Any) -> Any:
        other = chosen(kinds[-1])
        return (overload if other is None else other.get_overload)(kinds)

    def compile_for(*given: Any, **named: Any) -> Any:
        other = special.get(type(given[-1]))
        return (compile_for_python if other is None else other._compile_for_args)(*given, **named)

    general.get_call_template = template_of
    general.get_overload = overload_of
    general._compile_for_args = compile_for
    general.of = of
    return general
