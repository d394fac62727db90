"""Ono and Fukumoto's pursuit: four hunters that must surround a prey, with modules or with one table over all."""
