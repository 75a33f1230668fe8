"""Published numbers of other levers and of their materials, predicted and compared."""
