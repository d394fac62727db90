"""Tables: whatever rows come and go, a table holds what plain lists of rows would."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.core.table import Field, Table

FIELDS = (
    Field("member", np.int64, fill=-1),
    Field("place", np.float64, (2,), fill=0.5, reset="fill"),
    Field("speed", reset="first"),
    Field("note", np.object_, fill=None),
)
operations = st.lists(
    st.tuples(st.sampled_from(["append", "remove", "arrange", "cut", "declare", "assign", "reset", "pickle"]), st.integers(0, 9)),
    max_size=25,
)


def rows_of(table: Table) -> list[tuple[Any, ...]]:
    return list(zip(*(table[name].tolist() for name in table.fields), strict=True))


def made(*members: int) -> Table:
    table = Table(FIELDS)
    table.append(len(members), {"member": list(members), "speed": [10.0 * one for one in members]})
    return table


@pytest.mark.short
@given(operations)
def test_a_table_is_a_list_of_rows(plan: list[tuple[str, int]]) -> None:
    table, rows, first = made(), [], made(*range(200))
    come = 0
    for kind, value in plan:
        names = list(table.fields)
        if kind == "append":
            count = value % 4
            table.append(count, {"member": np.arange(come, come + count), "speed": 1.0, "note": np.full(count, "x", object)})
            for member in range(come, come + count):
                rows.append({name: field.fill for name, field in table.fields.items()} | {"member": member, "speed": 1.0, "note": "x", "place": [0.5, 0.5]})
            come += count
        elif kind == "remove" and rows:
            table.remove(value % len(rows))
            del rows[value % len(rows)]
        elif kind == "arrange":
            index = [(value + k) % (len(rows) + 1) - 1 for k in range(len(rows))]
            fills = {name: field.fill for name, field in table.fields.items()} | {"place": [0.5, 0.5]}
            table.arrange(np.array(index, np.int64))
            rows = [dict(fills) if k < 0 else dict(rows[k]) for k in index]
        elif kind == "cut":
            table.cut(value)
            rows = rows[:value]
        elif kind == "declare" and f"own {value}" not in table:
            table.declare(Field(f"own {value}", np.int64, fill=value))
            rows = [row | {f"own {value}": value} for row in rows]
        elif kind == "assign":
            kept = table.copy()
            other = made(3, 4)
            other.assign(table)
            table.append(2, {})
            table.assign(kept)
            assert rows_of(other) == rows_of(table)
        elif kind == "reset" and all(row["member"] >= 0 for row in rows):
            table.reset(first, table.member)
            rows = [row | {"place": [0.5, 0.5], "speed": 10.0 * row["member"]} for row in rows]
        elif kind == "pickle":
            table = pickle.loads(pickle.dumps(copy.deepcopy(table)))
        names = list(table.fields)
        assert len(table) == len(rows)
        assert rows_of(table) == [tuple(row[name] for name in names) for row in rows]
        assert all(table[name].flags.c_contiguous for name in names)


def test_each_reset_writes_the_columns_as_they_are_then() -> None:
    table, first = made(0, 1, 2), made(*range(9))
    other = Table([Field("place", np.float64, (2,), fill=2.5, reset="fill")], 3)
    changes: list[Callable[[], object]] = [
        lambda: None, lambda: first.arrange(np.arange(9)), lambda: table.arrange(np.arange(3)),
        lambda: table.append(500, {"member": 8}), lambda: table.remove(0), lambda: table.cut(3),
        lambda: table.declare(Field("own", fill=7.0, reset="fill")), lambda: table.write(other), lambda: table.drop("own"),
    ]  # fmt: skip
    for number, change in enumerate(changes):
        change()
        first.speed[:] = 10.0 * np.arange(9) + number
        for name in set(table.fields) - {"member", "note"}:
            table[name][:] = -1.0
        table.reset(first, table.member)
        assert table.speed.tolist() == [10.0 * member + number for member in table.member]
        for name in {"place", "own"} & set(table.fields):
            assert (table[name] == table.fields[name].fill).all()


def test_columns_stay_where_they_are_while_there_is_room() -> None:
    table = made(*range(3))
    places, room = {name: table.whole(name).ctypes.data for name in table.fields}, table.room
    for _ in range(room - len(table)):
        assert not table.append(1, {"member": 7})
        table.remove(1)
        table.append(1, {})
    other = table.copy()
    other.cut(5)
    table.assign(other)
    assert {name: table.whole(name).ctypes.data for name in table.fields} == places
    assert len(table) == 5
    assert table.room == room


def test_rows_that_take_much_memory_get_little_spare_room() -> None:
    table = Table([Field("large", shape=(2**20,))], 1)
    table.append(1, {})
    assert table.room <= 4


def test_an_unknown_column_names_those_that_there_are() -> None:
    with pytest.raises(AttributeError, match=r"no column 'sped', but member, place, speed, note"):
        _ = made().sped
