"""The paper's tables and figures, measured: a grid of campaigns, flown once each, kept, and set beside the paper.

``rows = load_results(folder)`` gives a notebook one flat row a campaign.
"""

from policy.evaluation.tables.load import load_frame, load_results

__all__ = ["load_frame", "load_results"]
