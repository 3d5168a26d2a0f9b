"""Work spread over processes and machines, kept through kills, and named by what it depends on."""
