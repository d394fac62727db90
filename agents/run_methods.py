"""What a world offers for its runs: to make steps, to change it, to record it, to save a state and go back to it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, overload

from teamsight.agents import mesa_bases, mesa_compat
from teamsight.agents.decisions.cycle import CycleLike
from teamsight.agents.events.mesa_events import MesaEvents
from teamsight.agents.given import AwarenessLike, Numbers, PolicyLike, SeedLike
from teamsight.agents.group import Group
from teamsight.agents.state import State, StateKeeper
from teamsight.core import checks
from teamsight.world.interaction import Interaction

if TYPE_CHECKING:
    from teamsight.agents.host import WorldHost
    from teamsight.agents.recording.world_replay import WorldReplay
    from teamsight.agents.world_data import FirstStates
    from teamsight.world.placement import Starts


class RunMethods(MesaEvents):
    """The methods of a world for its runs; `World` derives from it."""

    _states: StateKeeper
    _host: WorldHost

    def step(self) -> None:
        """Make one step, unless an event before it stops the model."""
        self._stepper.step()

    def run(self, steps: int, *, progress: bool = True) -> None:
        """Make `steps` steps, in one compiled call unless something needs Python in between.

        It stops early when `running` becomes False, and warns if it was False before. After two seconds, a terminal or
        a notebook shows how far it is, unless `progress` is False.
        """
        self._stepper.run(steps, progress=progress)

    @overload
    def adjust(
        self,
        group: Group,
        *,
        policy: PolicyLike | None = None,
        policy_options: Mapping[str, Any] | None = None,
        awareness: AwarenessLike | None = None,
        sensing_range: Numbers | None = None,
        awareness_range: Numbers | None = None,
        speed: Numbers | None = None,
        turn_limit: Numbers | None = None,
        cycle: CycleLike | None = None,
    ) -> None: ...
    @overload
    def adjust(self, group: Interaction, **fields: float | str) -> None: ...
    # The settings stand here again for the signature that `help` shows; fields of the same names may have other types.
    def adjust(  # type: ignore[misc]
        self,
        group: Group | Interaction,
        *,
        policy: PolicyLike | None = None,
        policy_options: Mapping[str, Any] | None = None,
        awareness: AwarenessLike | None = None,
        sensing_range: Numbers | None = None,
        awareness_range: Numbers | None = None,
        speed: Numbers | None = None,
        turn_limit: Numbers | None = None,
        cycle: CycleLike | None = None,
        **fields: float | str,
    ) -> None:
        """Change a group or an interaction from the next step on; what is not given stays.

        A new policy starts with a new state.

        Parameters
        ----------
        group : Group or Interaction
            A group of this world; or an interaction that is a dataclass: one of `interactions`, or what `interact` has
            returned, which keeps the values that were declared.
        policy, policy_options, awareness, sensing_range, awareness_range, speed, turn_limit
            Of a group, as for `add`.
        cycle : Cycle or float, optional
            As for `add`; it begins at the present tick, and actions on their way take effect when they were to.
        **fields : float or str
            Fields of an interaction. `reset` goes back to those that were declared, `restore` to those that were saved.

        Raises
        ------
        TypeError, ValueError
            As for `add` and `interact`; also if more than constants of the kernel of an interaction would change: what
            it declares, or the state in which a run begins. Nothing is changed then.
        """
        settings = {
            "policy": policy, "policy_options": policy_options, "awareness": awareness, "sensing_range": sensing_range,
            "awareness_range": awareness_range, "speed": speed, "turn_limit": turn_limit, "cycle": cycle,
        }  # fmt: skip
        if isinstance(group, Interaction):
            from teamsight.agents.interactions import adjust_interaction

            # Fields may have the names of settings.
            given = {name: value for name, value in settings.items() if value is not None}
            adjust_interaction(self._data, group, {**given, **fields})
            return
        for name, value in fields.items() if isinstance(group, Group) else ():
            cure = f"{checks.suggestion(name, settings)}a group has {', '.join(settings)}"
            raise TypeError(f"adjust(): {name}={checks.shown(value)}: unknown; {cure}")
        self._host.adjust(group, **settings)

    def register_agent(self, agent: mesa_bases.Agent) -> None:
        """Take an agent into the model and give it its `unique_id`; mesa calls this when an agent is made."""
        mesa_compat.number(self, agent)
        super().register_agent(agent)

    def run_for(self, duration: int) -> None:
        """Make this many steps; mesa's name for `run`."""
        self.run(duration)

    def run_until(self, end_time: int) -> None:
        """Make steps until `tick` is `end_time`."""
        self.run(checks.count("end_time", end_time, least=self.tick, cure="reset() goes back") - self.tick)

    def _advance_time(self, until: float) -> None:
        """Make steps until a time; mesa's simulators call this."""
        self.run(int(until) - self.tick)

    def record(
        self,
        file: str | os.PathLike[str] | None = None,
        *,
        steps: int | None = None,
        every: int = 1,
        title: str | None = None,
        force: bool = False,
    ) -> WorldReplay:
        """Record the run from now on, to watch it in any browser, or as a film or a picture.

        ::

            world.record("run.html", steps=600)         # makes the run

            with world.record("run.html"):              # or records what the block does
                world.run(600)

            replay = world.record()                     # or without a file
            world.run(600)
            replay.stop().save("run.gif")

        Parameters
        ----------
        file : path, optional
            The file to write: ``.html``, ``.gif``, ``.mp4`` or ``.png``. It is written when the recording stops: by
            `Replay.stop`, at the end of the block, by `close`, or when the program ends. A file that is there is
            replaced only if teamsight has written it as a recording.
        steps : int, optional
            Make so many steps, and stop.
        every : int
            Ticks from one frame to the next; the present is recorded too.
        title : str, optional
            What is recorded, for people; by default the class of the world, the policy and the seed.
        force : bool
            Replace any regular file.

        Returns
        -------
        Replay
            What is recorded. It grows with the run, and notebooks show it. A reset begins it anew; after a state is
            restored, the frames that follow it are dropped.

        Raises
        ------
        TypeError, ValueError
            If the world has no agents, the ending of the file is unknown, the file cannot be written or must not be
            replaced, or a value has the wrong type or is outside its limits. Nothing is changed then.
        ImportError
            For ``.mp4``, if imageio-ffmpeg is not installed.
        """
        from teamsight.agents.recording.world_replay import WorldReplay

        if steps is not None:
            checks.count("steps", steps, least=0)
        replay = WorldReplay(
            self._data, self._engine, type(self).__name__, file=file, every=every, title=title, force=force
        )
        if steps is not None:
            with replay:
                self.run(steps)
        return replay

    def state(self, *, pending: Literal["keep", "drop"] = "keep") -> State:
        """Return a copy of all that changes in a run; `restore` goes back to it. It can be pickled.

        It holds the event sources, the event log, and the planned calls of sources and of methods of the world and its
        agents. Other functions, and processes, which are running generators, cannot be saved.

        Parameters
        ----------
        pending : {"keep", "drop"}
            Whether planned functions and processes are an error, or are left out.

        Raises
        ------
        TypeError
            If there are any, and `pending` is "keep".
        """
        return self._states.save(pending)

    def restore(self, saved: State) -> None:
        """Go back to a saved state of this world, or of one that was built in the same way.

        Columns that were added after the state was saved keep their values.

        Raises
        ------
        TypeError, ValueError
            If `saved` is not a state, or is that of a world with another arena, other groups, policies or cycles.
            Nothing is changed then.
        """
        self._states.restore(saved)

    def reset(self, rng: SeedLike = None) -> None:
        """Start again: place all remaining agents anew and set the clock to 0, without events.

        Speeds, turning limits and ranges are those with which the groups were added. Policies, degrees of awareness and
        columns stay. `rng` is the seed, as for `World`; by default the present one.
        """
        self._states.reset(rng)

    def _begin(self, seed: int, start: Starts, run: int, states: FirstStates) -> None:
        """Begin a run in the existing arrays; see `StateKeeper.begin`."""
        self._states.begin(seed, start, run, states, is_kept=True)

    def close(self) -> None:
        """Stop the model for good; recordings stop and are written."""
        self.running = False
        self._stepper.is_closed = True
        for watcher in list(self._data.watchers):
            watcher.close()
