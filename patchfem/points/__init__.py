"""Steps of order 2 from return maps: motion of many contact points, and sweeps over many cases."""
