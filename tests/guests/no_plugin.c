int nothing_for_cutproof(void) { return 0; }
