"""Palletising in the least time: the cycle of Cao et al. (2012), its optimum in closed form and by every solver."""

from nlpweld.palletising.task import PalletTask, load_pallet_task
from nlpweld.palletising.totals import Palletised, palletize

__all__ = ["PalletTask", "Palletised", "load_pallet_task", "palletize"]
