"""Explanations of programs from their texts and errors: causes of failures, mistakes, lines that wait for ever."""
