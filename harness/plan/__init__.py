"""An experiment as cells and turns: what runs, in which order, how long it will take, what a resumed run lacks."""
