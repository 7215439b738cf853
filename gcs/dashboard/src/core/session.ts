/** The key for this tab only: gone when the tab is closed. */

const NAME = "gcs-key";

export const storedKey = (): string | null => sessionStorage.getItem(NAME);

export function keepKey(key: string | null): void {
  if (key === null) sessionStorage.removeItem(NAME);
  else sessionStorage.setItem(NAME, key);
}
