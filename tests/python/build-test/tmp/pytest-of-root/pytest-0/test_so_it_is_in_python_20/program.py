import swarmtalk
swarmtalk.Client('x', '/nowhere/s')
