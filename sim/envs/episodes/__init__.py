"""Episodes: actions, observations, and one episode on a bench."""
