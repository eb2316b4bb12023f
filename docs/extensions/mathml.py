"""Formulas as MathML, which browsers draw themselves: no script, no font, no network."""

from typing import Any
from xml.etree import ElementTree as Tree

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

_BARS = {"|", "‖"}
_OPENING = {"(", "[", "=", ",", "+", "−", "⋅", "×", "≤", "/"}


def mathml(formula: str, display: str = "inline") -> str:
    """A formula of LaTeX as a <math> element, with the spaces that TeX would leave."""
    # The converter knows split, which is the same in a display.
    known = formula.replace("{aligned}", "{split}")
    Tree.register_namespace("", "http://www.w3.org/1998/Math/MathML")
    root = Tree.fromstring(convert(known, display=display))
    for row in list(root.iter()):
        _space(row)
    return Tree.tostring(root, encoding="unicode")


def _space(row: Tree.Element) -> None:
    """Close up bars and signs, set functions off from their neighbours, make primes visible."""
    children = [each for each in row if _tag(each) != "mspace"]
    for before, each, after in zip(
        [None, *children], children, [*children[1:], None], strict=False
    ):
        text = each.text or ""
        is_operator = _tag(each) == "mo"
        if is_operator and text in _BARS:
            each.attrib |= {"stretchy": "false", "lspace": "0", "rspace": "0"}
        elif is_operator and text in "+−" and before is not None and before.text in _OPENING:
            each.attrib |= {"form": "prefix", "lspace": "0", "rspace": "0"}
        elif text == "′":
            each.set("mathsize", "140%")  # as fonts without a table for formulas draw it too small
        elif _is_function(each):
            is_applied = after is None or after.text in ("(", ",", ")")
            beside_letter = before is not None and _tag(before) != "mo"
            row.insert(list(row).index(each) + 1, _thin(0.0 if is_applied else 0.17))
            row.insert(list(row).index(each), _thin(0.17 if beside_letter else 0.0))


def _is_function(element: Tree.Element) -> bool:
    return _tag(element) == "mi" and len(element.text or "") > 1


def _thin(width: float) -> Tree.Element:
    return Tree.Element("mspace", {"width": f"{width:g}em"})


def _tag(element: Tree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    formula = mathml(node.astext(), display="block")
    translator.body.append(f'<div class="formula">{formula}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
