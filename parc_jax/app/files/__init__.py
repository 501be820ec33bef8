"""Scenes, networks, answers and questions to other verifiers as files."""
