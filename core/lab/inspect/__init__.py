"""What each object costs, and why: findings for artists; and warnings where numbers get out of hand."""

from .finding import Finding, as_dict
from .inspection import Inspection, inspect
from .precision import warnings
from .words import text

__all__ = ["Finding", "Inspection", "as_dict", "inspect", "text", "warnings"]
