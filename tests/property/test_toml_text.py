"""Values that scenes are written with are the values that TOML reads."""

from __future__ import annotations

import tomllib

from hypothesis import given
from hypothesis import strategies as st

from bh.scene.toml_text import key_of, written

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)  # halves of pairs are no text
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False) | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=8,
)


@given(TEXTS, VALUES)
def test_what_is_written_is_read(name: str, value: object) -> None:
    assert tomllib.loads(f"{key_of(name)} = {written(value)}  # and a comment") == {name: value}
