"""Corridors that hold the safe set: drawn, chosen, counted until enough is covered. [T27, T31]"""
