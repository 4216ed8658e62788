"""The methods as their authors wrote them: numpy, scipy and the robot only, sharing nothing with the framework."""
