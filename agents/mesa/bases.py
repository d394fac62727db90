"""mesa's base classes. mesa has no type information, which would let every attribute pass: the stub file has it."""

from mesa import Agent as Agent
from mesa import Model as Model
