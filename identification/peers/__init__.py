"""The same recordings through other packages: figaroh and mujoco.sysid, side by side with this one."""
