"""The one plan that is driven, and what can honestly be said of it. [T23]"""
