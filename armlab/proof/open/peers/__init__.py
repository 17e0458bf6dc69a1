"""The same recordings identified by other packages, figaroh and mujoco.sysid, side by side with this one."""
