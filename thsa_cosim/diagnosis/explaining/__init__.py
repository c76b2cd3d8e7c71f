"""What else the recordings say: balances, dependence, empirical laws, the experiment that tells rivals apart."""
