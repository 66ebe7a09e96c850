//! Nothing but a test: Haply's own client, as it is published, against the simulated Inverse service.
