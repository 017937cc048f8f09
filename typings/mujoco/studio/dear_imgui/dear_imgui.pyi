"""Dear ImGui, which has a name for everything and types for nothing."""

from typing import Any

def __getattr__(name: str) -> Any: ...
