"""The events that a page lists: contacts of one tick are one row, and leave room for other events."""

from __future__ import annotations

import live_models
import pytest

from teamsight.live.worlds import MOST_CONTACTS, MOST_EVENTS, event_rows


@pytest.mark.parametrize("steps", [0, 5, 80])
def test_contacts_of_a_tick_are_one_row(steps: int) -> None:
    world = live_models.meeting()
    world.run(steps)
    table, found = world.contacts, event_rows(world)
    assert found["total"] == len(table) + (steps >= 3)
    contacts = [row for row in found["rows"] if "contact" in row[1]]
    wanted = []
    for channel in ("teammates", "targets"):
        groups = table[table.channel == channel].groupby(["tick", "begun"])
        newest = sorted(groups, key=lambda one: (-one[0][0], not one[0][1]))[:MOST_CONTACTS]
        for (tick, begun), rows in newest:
            end = "begun" if begun else "ended"
            if len(rows) == 1:
                (row,) = rows.itertuples()
                wanted.append([tick, f"contact {end}", "robots", row.observer, {"other": row.observed, "channel": channel}])
            else:
                wanted.append([tick, f"{len(rows)} contacts {end}", "robots", None, {"channel": channel}])
    assert contacts == sorted(wanted, key=lambda row: -row[0])
    assert steps == 0 or {len(row[1].split()) for row in contacts} == {2, 3}
    # They leave room for what happens seldom.
    assert [row[4] for row in found["rows"] if row[1] == "painted"] == [{"colour": "red"}] * (steps >= 3)
    assert len(contacts) <= 2 * MOST_CONTACTS


def test_the_newest_rows_come_first_and_are_few() -> None:
    world = live_models.meeting()
    for number in range(150):
        world.log("noted", number=number)
    world.run(2)
    rows = event_rows(world)["rows"]
    assert len(rows) == MOST_EVENTS
    assert [row[0] for row in rows] == sorted((row[0] for row in rows), reverse=True)
    assert next(row for row in rows if row[1] == "noted")[4] == {"number": 149}
