"""Ground control: campaigns flown over MAVLink, safety, records, API and the operator's page."""
