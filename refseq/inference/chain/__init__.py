"""The hidden Markov chain over places: motion model, forward-backward, Viterbi (chapter 3)."""
