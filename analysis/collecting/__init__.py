"""Mataric's collecting: which scheme of reinforcement learns the correct policy, and whether more than one bit pays."""
